"""Write a first configuration for a mesh or a CT of one's own: ``palpate init``."""
