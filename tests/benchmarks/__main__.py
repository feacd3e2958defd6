"""Print the benchmark tables: `python -m tests.benchmarks [topic ...]`.

A topic is a file beside this one with a function `table() -> str` that measures and returns a finished markdown table.
"""

import importlib
import sys
from pathlib import Path


def main(wanted: list[str]) -> int:
    """Print the tables of the wanted topics, all if none is named."""
    topics = sorted(path.stem for path in Path(__file__).parent.glob("*.py") if not path.stem.startswith("_"))
    topics = [topic for topic in topics if topic not in ("measure", "models")]
    if unknown := sorted(set(wanted) - set(topics)):
        print(f"no benchmark named {', '.join(unknown)}; there are {', '.join(topics)}", file=sys.stderr)
        return 2
    for topic in wanted or topics:
        print(f"## {topic}\n\n{importlib.import_module(f'tests.benchmarks.{topic}').table()}\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
