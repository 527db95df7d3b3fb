"""Write README.md of a folder of questions, which suffices for who knows nothing of palpate."""

from pathlib import Path

from palpate.benchmark.touch import BEFORE
from palpate.bodies.material import LAWS
from palpate.exchange.asked_body import FURTHER, formula, law_named
from palpate.exchange.folder import Questions
from palpate.files import templates


def readme(questions: Questions, law: str) -> bytes:
    """Return the page of that kind of questions; ``law`` is the body's, a name or a file."""
    environment = templates(Path(__file__).parent / "pages")
    others = {name: formula(law_named(name)) for name in (*LAWS, *FURTHER) if name != questions.info["law"]}
    names = {"questions": questions, "info": questions.info, "formula": formula(law), "others": others}
    return environment.get_template(f"{questions.kind}.md").render(names | {"before": BEFORE}).encode()
