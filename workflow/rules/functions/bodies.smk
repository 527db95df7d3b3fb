# The files that bodies are made from.

# settings of a body that say how many samples it gets and what the paper had, not what it is
NOT_OF_THE_BODY = {"magnitudes", "train", "test", "paper_surface"}


def body_paths(name):
    """The files or folders a body is made from, by key; given relative to the folder of the config file."""
    return paths_of_body(config["bodies"][name], CONFIG_FILE.parent)


def body_files(name):
    """The files a body is made from; of a folder, such as a DICOM series, every one in it."""
    paths = map(Path, body_paths(name).values())
    return [str(file) for path in paths for file in (sorted(path.iterdir()) if path.is_dir() else [path])]


def body_entry(name):
    """What a body is made from."""
    body = config["bodies"][name] | body_paths(name)
    return {key: value for key, value in body.items() if key not in NOT_OF_THE_BODY}
