"""Portable models: a file that holds a prepared model for any place of a surface, and runtimes that answer from it."""
