"""The report's page and its look, apart from what it says."""

from __future__ import annotations

from string import Template

__all__ = ["PAGE", "STYLE"]

STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
  max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.25; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin-top: 2rem; border-bottom: 1px solid #bbb; }
h3 { font-size: 1rem; }
.verdict { padding: .6rem .9rem; border-left: .4rem solid #0072b2; background: #eef5fa; }
.verdict.failed { border-left-color: #a11d00; background: #fbeeea; font-weight: 600; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: .92rem; }
caption { text-align: left; color: #555; padding-bottom: .3rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .7rem .3rem 0;
  border-bottom: 1px solid #ddd; overflow-wrap: break-word; }
td:last-child { overflow-wrap: anywhere; }
th[scope=row] { font-weight: 500; min-width: 9rem; }
thead th { border-bottom: 2px solid #777; }
td { font-variant-numeric: tabular-nums; }
tr.failed th, tr.failed td { color: #a11d00; font-weight: 600; }
tr.total th, tr.total td { font-weight: 600; border-top: 1px solid #777; }
figure { margin: 1rem 0; }
img { max-width: 100%; height: auto; display: block; margin: 0 auto; }
figcaption { color: #555; font-size: .92rem; }
@page { margin: 15mm; }
@media print {
  body { font-size: 10pt; margin: 0; max-width: none; padding: 0; }
  h2, h3, caption { break-after: avoid; }
  tr, figure, .verdict { break-inside: avoid; }
  img { max-height: 235mm; }
  .verdict, tr.failed td { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
"""

# The policy makes the promise binding: nothing is fetched and nothing is run.
PAGE = Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>$style</style>
</head>
<body>
<main>
$body
</main>
</body>
</html>
"""
)
