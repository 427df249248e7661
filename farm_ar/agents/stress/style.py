"""How the page of a stress test looks."""

STYLE = """
:root { --ink: #1f2937; --faint: #6b7280; --line: #e5e7eb; --accent: #2563eb; }
* { box-sizing: border-box; }
body { margin: 0; background: #f8fafc; color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 24px 20px 60px; }
header h1 { font-size: 30px; line-height: 1.2; margin: 12px 0 6px; letter-spacing: -0.01em; }
header p { margin: 0 0 10px; color: var(--faint); }
pre, code { font: 12.5px/1.5 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }
pre { background: #0f172a; color: #e2e8f0; padding: 10px 14px; border-radius: 8px; white-space: pre-wrap; }
.cards { display: flex; flex-wrap: wrap; gap: 14px; margin: 18px 0; }
.card { background: white; border: 1px solid var(--line); border-radius: 12px; padding: 14px 18px;
  flex: 1 1 200px; border-top: 4px solid var(--accent); }
.card .name { font-weight: 600; color: var(--accent); }
.card .big { font-size: 38px; font-weight: 700; line-height: 1.15; }
.card .what, .card .note { color: var(--faint); font-size: 13px; }
.card .note { margin-top: 6px; color: var(--ink); }
section { background: white; border: 1px solid var(--line); border-radius: 12px; padding: 16px 20px;
  margin: 16px 0; }
h2 { font-size: 18px; margin: 0 0 12px; } h3 { font-size: 15px; margin: 18px 0 8px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; margin: 6px 0; font-variant-numeric: tabular-nums; }
td { white-space: nowrap; }
th, td { text-align: right; padding: 5px 10px; border-bottom: 1px solid var(--line); vertical-align: bottom; }
th { font-weight: 600; color: var(--faint); }
th:first-child, td:first-child { text-align: left; font-weight: 600; }
svg.chart { max-width: 100%; height: auto; display: block; font-family: inherit; }
.row > div { min-width: 0; }
.legend { max-width: 480px; display: flex; flex-wrap: wrap; gap: 4px 16px; font-size: 13px;
  margin: 4px 0 10px 50px; }
.legend span { white-space: nowrap; }
.row { display: flex; flex-wrap: wrap; gap: 24px; align-items: flex-start; }
.row figure { width: 320px; } .row figure:only-child { width: auto; }
figure { margin: 0; } figcaption { font-size: 12.5px; color: var(--faint); margin-top: 6px; }
.gallery { display: grid; grid-template-columns: repeat(auto-fill, minmax(310px, 1fr)); gap: 16px; }
.failure { border: 1px solid var(--line); border-radius: 10px; padding: 10px; }
.failure code { display: block; margin-top: 6px; background: #f1f5f9; padding: 4px 8px; border-radius: 6px;
  color: var(--ink); user-select: all; }
svg.picture { width: 100%; height: auto; max-height: 420px; display: block; font-family: inherit; }
svg .away { fill-opacity: 0.4; stroke: #9ca3af; stroke-width: 0.6; }
svg .tag { font-size: 11px; font-weight: 600; fill: #b91c1c; paint-order: stroke; stroke: white;
  stroke-width: 3px; stroke-linejoin: round; }
p { margin: 8px 0; max-width: 80ch; }
@media print { body { background: white; } section, .card, .failure { break-inside: avoid; } }
"""
"""One sheet of CSS; nothing is loaded from anywhere."""
