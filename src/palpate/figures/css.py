"""The report's style sheet: plain, readable, light and dark."""

CSS = """
:root { color-scheme: light dark; --ink: light-dark(#1d2329, #e4e7ea); --paper: light-dark(#fff, #15191d);
  --faint: light-dark(#66707a, #98a2ac); --line: light-dark(#dfe3e7, #333a41); --link: light-dark(#00664a,
  #4cc9a0);
  --panel: light-dark(#f5f7f8, #1d2227); }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 72rem; padding: 1.5rem 1.25rem 4rem; background: var(--paper); color:
  var(--ink);
  font: 1rem/1.55 system-ui, sans-serif; }
a { color: var(--link); }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .5rem; }
h2 { margin: 3rem 0 .5rem; padding-top: .8rem; border-top: 1px solid var(--line); font-size: 1.35rem; }
h3 { margin: 1.8rem 0 .4rem; font-size: 1.05rem; }
.headline { font-size: 1.15rem; border-left: 4px solid var(--link); padding: .2rem 0 .2rem 1rem; margin:
  1.2rem 0; }
nav p { margin: .6rem 0 0; font-weight: 600; }
nav ul { margin: 0; display: flex; flex-wrap: wrap; gap: .2rem 1.2rem; list-style: none; padding: 0; }
p, li { max-width: 48rem; }
.scroll { overflow-x: auto; margin: .8rem 0; }
table { border-collapse: collapse; font-size: .88rem; font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--faint); padding-bottom: .3rem; }
th, td { padding: .25rem .7rem; border-bottom: 1px solid var(--line); text-align: left; vertical-align:
  top; }
th { background: var(--panel); }
td.number, th.number { text-align: right; white-space: nowrap; }
tr.paper td { color: var(--faint); }
td.best { font-weight: 700; }
figure { margin: 1.2rem 0; }
figure img { max-width: 100%; height: auto; background: #fff; border: 1px solid var(--line); border-
  radius: 4px; }
figcaption, .note { color: var(--ink); font-size: .93rem; }
summary { cursor: pointer; color: var(--link); }
details { margin: .6rem 0; }
"""
