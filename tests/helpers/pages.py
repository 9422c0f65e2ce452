"""What a page is measured by in a browser."""

#: A4 less margins of 15 mm, in CSS pixels of 1/96 inch.
PAPER = {"width": round(180 / 25.4 * 96), "height": round(267 / 25.4 * 96)}

#: What stands out of the paper or of its own cell, and what is too tall for a sheet.
_CUT = """() => {
  const name = e => `${e.tagName} ${e.textContent.trim().slice(0, 60)}`;
  const box = e => e.getBoundingClientRect();
  const all = [...document.querySelectorAll('body *')];
  const whole = [...document.querySelectorAll('tr, figure, .verdict')];
  return [
    ...all.filter(e => box(e).right > innerWidth + 1 || box(e).left < -1),
    ...all.filter(e => e.matches('td, th, p, li') && e.scrollWidth > e.clientWidth + 1),
    ...whole.filter(e => box(e).height > innerHeight),
  ].map(name);
}"""


def cut(page) -> list[str]:
    """Return what would be cut on a sheet, of a page that is as wide and high as one."""
    page.emulate_media(media="print")
    return page.evaluate(_CUT)


def violations(page, axe: str) -> dict[str, list[str]]:
    """Return the rules of accessibility that a page breaks, and where."""
    page.evaluate(axe)  # the policy of a page does not hold for it
    found = page.evaluate("axe.run()")
    assert len(found["passes"]) > 10
    return {each["id"]: [node["html"] for node in each["nodes"]] for each in found["violations"]}
