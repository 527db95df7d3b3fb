"""Take prepared models along: a file that holds one for any place of a surface, and what answers from it."""
