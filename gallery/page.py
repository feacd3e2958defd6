"""One HTML page of cards: no script, no network, light and dark."""

from collections.abc import Sequence
from html import escape

from gallery.cards import Card, Job
from gallery.catalog import Entry, catalog
from gallery.typeset import typeset

_STYLE = """
:root { color-scheme: light dark; --page: #f4f5f7; --card: #fff; --ink: #1c2128; --soft: #5c6672; --line: #dfe3e8;
  --good: #1a7f4b; --bad: #c1121f; }
@media (prefers-color-scheme: dark) { :root { --page: #15181c; --card: #1f242b; --ink: #e6e9ed; --soft: #9aa5b1;
  --line: #323a44; --good: #4cc38a; --bad: #ff6b6b; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 15px/1.45 system-ui, sans-serif; }
header, footer { max-width: 1500px; margin: auto; padding: 2.2rem 1.5rem 0.6rem; }
footer { padding: 0.6rem 1.5rem 2.5rem; color: var(--soft); font-size: 0.85rem; }
h1 { margin: 0 0 0.2rem; font: 600 2rem/1.2 Georgia, serif; }
header p { margin: 0; color: var(--soft); max-width: 60rem; }
main { max-width: 1500px; margin: auto; padding: 1.2rem 1.5rem; display: grid; gap: 1.3rem;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, 21rem), 1fr)); }
article { background: var(--card); border: 1px solid var(--line); border-radius: 10px; overflow: hidden;
  display: flex; flex-direction: column; }
article.bad { border: 2px solid var(--bad); }
article img { display: block; width: 100%; height: auto; background: #fff; }
figure { margin: 0; border-top: 1px solid var(--line); }
figcaption { padding: 0.3rem 1.1rem 0; color: var(--soft); font-size: 0.8rem; }
.text { padding: 0.9rem 1.1rem 1rem; display: flex; flex-direction: column; gap: 0.55rem; flex: 1; }
h2 { margin: 0; font: 600 1.15rem/1.3 Georgia, serif; }
.formula { font-family: Georgia, "Times New Roman", serif; overflow-wrap: anywhere; }
sup, sub { line-height: 0; font-size: 0.72em; }
dl { margin: 0; display: grid; grid-template-columns: auto 1fr; gap: 0.1rem 0.8rem; font-size: 0.88rem; }
dt { color: var(--soft); }
dd { margin: 0; font-variant-numeric: tabular-nums; }
.source { margin: auto 0 0; color: var(--soft); font-size: 0.8rem; }
.problem { margin: 0; color: var(--bad); font-weight: 600; overflow-wrap: anywhere; }
.absent { aspect-ratio: 4 / 3; display: grid; place-items: center; color: var(--bad); background: #c1121f18;
  font: 600 1.1rem Georgia, serif; }
"""


def write_page(cards: Sequence[Card], job: Job) -> None:
    """Write index.html into the job's folder."""
    entries = catalog()
    bad = [card for card in cards if not card.good]
    count = f"{len(cards)} surfaces" if len(cards) != 1 else "1 surface"
    state = f"{count}, each as its facts say" if not bad else f"{count}, {len(bad)} of them not as they should be"
    total = sum(card.triangles for card in cards)
    body = "\n".join(_article(card, entries[card.name], job) for card in cards)
    page = f"""<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Gallery of surfaces</title>
<style>{_STYLE}</style>
<header><h1>Gallery of surfaces</h1>
<p>{state}. Outside and inside have a colour each, the rim of an open surface is a thin line, singular points and
curves are red.</p></header>
<main>
{body}
</main>
<footer>{total:,} triangles, quality {job.quality}. The distance is the largest found between triangles and surface,
as a share of the surface’s diagonal; χ is the Euler characteristic of the triangles.</footer>
</html>
"""
    (job.folder / "index.html").write_text(page, encoding="utf-8")


def _article(card: Card, entry: Entry, job: Job) -> str:
    title = escape(entry.title)
    width, height = job.size
    picture = f'<div class="absent">{title}: no picture</div>'
    if card.picture:
        picture = (
            f'<a href="{card.picture}"><img src="{card.picture}" width="{width}" height="{height}" '
            f'alt="{title}" loading="lazy"></a>'
        )
    if card.beside:
        picture += (
            f'<figure><a href="{card.beside}"><img src="{card.beside}" width="{width}" height="{height}" '
            f'alt="{title} by scikit-image" loading="lazy"></a>'
            f"<figcaption>the same cells by scikit-image’s marching cubes</figcaption></figure>"
        )
    problems = "".join(
        f'<p class="problem">{escape(text)}</p>' for text in (card.failure, *card.contradictions) if text
    )
    rows = "".join(f"<dt>{name}</dt><dd>{value}</dd>" for name, value in _rows(card))
    where = "".join(f", <i>{name}</i> = {typeset(text)}" for name, text in entry.parameters.items())
    return f"""<article id="{card.name}"{"" if card.good else ' class="bad"'}>
{picture}
<div class="text"><h2>{title}</h2>
<div class="formula">{typeset(entry.formula)}{where}</div>{problems}
<dl>{rows}</dl>
<p class="source">{escape(entry.source)}. <code>{card.name}</code></p></div>
</article>"""


def _rows(card: Card) -> list[tuple[str, str]]:
    """Names and values of what the card says."""
    if card.failure:
        return [("seconds", f"{card.seconds:.1f}")]
    rows = [("degree", str(card.degree))] if card.degree is not None else []
    if card.singular_points is not None:
        unsure = "" if card.complete else " (perhaps more)"
        kinds = f" ({_types(card.types)})" if card.types else ""
        rows.append(("singular points", f"{card.singular_points}{kinds}{unsure}"))
    if card.singular_curves:
        rows.append(("singular curves", str(card.singular_curves)))
    ends = "closed" if card.closed else "with a rim"
    euler = f", χ = {str(card.euler).replace('-', '−')}" if card.conforming else ""
    rows.append(("triangles", f"{card.triangles:,}, {ends}{euler}"))
    rows.append(("distance", _power(card.distance / card.diagonal)))
    rows.append(("seconds", f"{card.seconds:.1f}"))
    return rows


def _types(types: str) -> str:
    """Types such as 4 A1 with the number lowered and the count set off.

    >>> _types("4 A1, E6")
    '4 <i>A</i><sub>1</sub>, <i>E</i><sub>6</sub>'
    """
    parts = [part.split() for part in types.split(", ")]
    return ", ".join(" ".join([*part[:-1], f"<i>{part[-1][0]}</i><sub>{escape(part[-1][1:])}</sub>"]) for part in parts)


def _power(value: float) -> str:
    """A small number as people write it.

    >>> _power(0.00032)
    '3.2 · 10<sup>−4</sup>'
    """
    if value == 0:
        return "0"
    digits, exponent = f"{value:.1e}".split("e")
    return f"{digits} · 10<sup>{exponent.replace('-', '−').replace('−0', '−')}</sup>"
