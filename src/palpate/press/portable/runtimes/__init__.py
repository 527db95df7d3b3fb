"""Runtimes that answer from a portable model file without palpate: in Python, JavaScript and C."""
