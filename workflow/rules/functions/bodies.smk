# The files that bodies are made from.

# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


def body_files(name):
    """The files a body is made from; of a folder, such as a DICOM series, every one in it."""
    paths = map(Path, settings.bodies[name].paths(CONFIG_FILE.parent).values())
    return [str(file) for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]


def body_entry(name):
    """What a body is made from."""
    body = plain(settings.bodies[name].seen_from(CONFIG_FILE.parent))
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}
