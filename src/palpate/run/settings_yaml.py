"""Read a user's file of settings: YAML 1.2, with every fault of it in one sentence.

What its keys may be is checked in run/settings.py. Files of the workflow's own are read by ``files.read_yaml``.
"""

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from palpate.errors import InputError

if TYPE_CHECKING:
    import yaml

_PLAIN = {
    "null": r"~|null|Null|NULL|",
    "bool": r"true|True|TRUE|false|False|FALSE",
    "int": r"[-+]?[0-9][0-9_]*",
    "float": r"[-+]?(\.[0-9]+|[0-9][0-9_]*(\.[0-9_]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
}
"""What is no text, by its type, as YAML 1.2 has it: 1e-8 is a number, and yes and 1:30 are texts."""


def read_settings(file: Path) -> dict:
    """Return the settings in ``file``; raise InputError naming line, column and remedy if it cannot be read."""
    import yaml

    text = _text(file)
    try:
        settings = yaml.load(text, _loader(file))
    except yaml.MarkedYAMLError as error:
        raise InputError(f"{file}: {_explain(error, text)}") from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        raise InputError(f"{file}: line {line} has a character that cannot be printed; remove it.") from None
    try:
        json.dumps(settings)
    except (ValueError, RecursionError):
        raise InputError(f"{file} has an entry that holds itself; write out what its * refers to.") from None
    if settings is None:
        raise InputError(f"{file} is empty; give it bodies, and the block of a study.")
    if not isinstance(settings, dict):
        kind = "a list" if isinstance(settings, list) else "a text" if isinstance(settings, str) else "one value"
        raise InputError(f"{file} holds {kind}, and must hold keys such as bodies: at the beginning of its lines.")
    return settings


def _text(file: Path) -> str:
    try:
        return file.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{file} is missing; give the path of a file of settings.") from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise InputError(f"{file}: line {line} is not UTF-8; save the file with that encoding.") from None
    except OSError as error:
        raise InputError(f"{file} cannot be read ({error.strerror}); give the path of a file of settings.") from None


def _loader(file: Path) -> type["yaml.SafeLoader"]:
    """Return a loader of YAML 1.2 whose keys are texts that occur once."""
    import yaml

    class Loader(yaml.SafeLoader):
        yaml_implicit_resolvers: ClassVar[dict] = {}

        def compose_mapping_node(self, anchor: str | None) -> yaml.MappingNode:
            node = super().compose_mapping_node(anchor)
            lines: dict[str, int] = {}
            for key, _ in node.value:
                line = key.start_mark.line + 1
                if not isinstance(key, yaml.ScalarNode):
                    raise InputError(f"{file}: line {line} has brackets where a key belongs; write a name.")
                if key.value in lines:
                    raise InputError(
                        f"{file}: line {line} has the key {key.value} again, which line {lines[key.value]} has; "
                        "remove or rename one of them."
                    )
                lines[key.value] = line
                if key.value != "<<":
                    key.tag = "tag:yaml.org,2002:str"
            return node

        def construct_yaml_int(self, node: Any) -> int:
            return int(self.construct_scalar(node))

    for kind, pattern in _PLAIN.items():
        Loader.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", re.compile(f"^(?:{pattern})$"), None)
    Loader.add_implicit_resolver("tag:yaml.org,2002:merge", re.compile("^<<$"), ["<"])
    Loader.add_constructor("tag:yaml.org,2002:int", Loader.construct_yaml_int)
    return Loader


def _explain(error: "yaml.MarkedYAMLError", text: str) -> str:
    mark = error.problem_mark or error.context_mark
    lines = text.splitlines()
    line = lines[mark.line] if mark and mark.line < len(lines) else ""
    place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "it"
    if "\t" in line[: mark.column + 1 if mark else 0]:
        return f"{place} has a tab; indent with spaces."
    problem = (error.problem or "not YAML").replace("\n", " ")
    if "<block end>" in problem and error.context_mark:
        begun = error.context_mark.line + 1
        return f"{place} does not continue the block of line {begun}; indent its lines alike, as keys or as a list."
    since = ""
    if error.context_mark and mark and error.context_mark.line != mark.line:
        since = f", {error.context} that line {error.context_mark.line + 1} begins"
    remedy = "check its indentation, colons, quotes and brackets"
    if "mapping values are not allowed" in problem:
        remedy = "give one key a line, indented as its neighbours, and quote texts with colons"
    return f"{place} is not YAML ({problem}{since}); {remedy}."
