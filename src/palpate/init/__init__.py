"""Write a configuration for a mesh or a CT of one's own (``palpate init``), and run it small (``palpate try``)."""
