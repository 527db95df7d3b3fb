"""Turn an error of snakemake's into one sentence with a remedy."""

import re
import sys
from pathlib import Path

from palpate.errors import InputError
from palpate.run.settings_file import read_settings
from palpate.run.system_faults import of_text
from snakemake_logger_plugin_palpate import targets

_LAST = "At least one job did not complete successfully."


def explain(errors: list[tuple[str, str]]) -> str:
    """Return the sentence for the errors of a run; empty for what is not foreseen.

    errors : the exception's class and snakemake's text for each, oldest first
    """
    return next((sentence for kind, text in errors if (sentence := _known(kind, text))), "")


def quote(errors: list[tuple[str, str]]) -> str:
    """Return an error that is not foreseen in one line, for whom the log is of use."""
    kind, text = next((error for error in errors if _LAST not in error[1]), errors[0])
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    # of a traceback, the last line says what happened
    line = lines[-1] if lines and lines[0].startswith("Traceback") else " ".join(lines)[:300]
    return f"snakemake stopped ({line or kind}); its log says where."


def _known(kind: str, text: str) -> str:
    if found := re.search(r"No rule to produce (.+?) \(if you use", text):
        return targets.explain(found[1])
    if found := re.search(r"(?:InputError|palpate\.errors\.InputError)[^\n]*?:\s*(.+)", text):
        return found[1].strip()
    if kind == "FileNotFoundError" and (found := re.search(r"'([^']+)'\s*$", text)) and found[1] in sys.argv:
        return f"{found[1]} is missing; check its path (targets stand after --, apart from files of settings)."
    if sentence := _of_settings():
        return sentence
    if found := re.search(r"KeyError: '(\w+)'.*\b(\w+)=\1\b", text, re.S):
        return f"nothing in the settings is called {found[1]}; check the name of the {found[2]} that was asked for."
    if kind == "MissingInputException":
        files = text.partition("affected files:")[2].split()
        return f"{', '.join(files[:3])} cannot be found, and nothing makes it; put it there, or remove what names it."
    if "No Snakefile found" in text:
        return "there is no Snakefile in this folder; go to palpate's folder, or name its Snakefile with -s."
    return of_text(text)


def _of_settings() -> str:
    """Return what is wrong with the files of settings on the command line: snakemake itself gives no line."""
    for word in sys.argv[1:]:
        if Path(word).suffix in (".yaml", ".yml", ".json") and Path(word).is_file():
            try:
                read_settings(Path(word))
            except InputError as error:
                return str(error)
    return ""
