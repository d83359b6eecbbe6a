// SPDX-License-Identifier: Apache-2.0
#include "takt/report/html.h"

namespace takt::report {

// Colours: series have a contrast of 3:1 and text one of 4.5:1 against their paper, light and dark [WCAG 2.1].
const char* const page_style = R"css(
:root {
  color-scheme: light dark;
  --paper: #fff; --ink: #1b1e23; --soft: #59616b; --faint: #dfe3e8; --wash: #f5f7f9;
  --trusted: #176b3a; --weak: #8a5300; --refused: #a3211f;
  --c0: #0f62ac; --c1: #d1490c; --c2: #11795a; --c3: #8a3ca6; --c4: #8a6a00; --c5: #56606b;
  --serif: Charter, "Bitstream Charter", "Iowan Old Style", "Source Serif 4", Palatino, Georgia, "DejaVu Serif", serif;
  --sans: "Inter", "Helvetica Neue", "Segoe UI", Roboto, "Noto Sans", Arial, "DejaVu Sans", sans-serif;
  --mono: ui-monospace, "SF Mono", Menlo, Consolas, "DejaVu Sans Mono", monospace;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171b; --ink: #e6e9ec; --soft: #a0a9b3; --faint: #30363d; --wash: #1c2025;
    --trusted: #5fca8b; --weak: #e5ad4f; --refused: #ff8178;
    --c0: #6db3f2; --c1: #ff9a62; --c2: #55c9a0; --c3: #d09bea; --c4: #dcc04f; --c5: #a9b4bf;
  }
}
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 17px/1.55 var(--serif); }
main { max-width: 62rem; margin: 0 auto; padding: 3rem 1.5rem 4rem; }
h1, h2, h3 { font-weight: 600; line-height: 1.25; text-wrap: balance; margin: 0; }
h1 { font-size: clamp(1.55rem, 1.1rem + 2vw, 2.3rem); letter-spacing: -.012em; }
h1 b { font-weight: inherit; white-space: nowrap; color: var(--c0); font-variant-numeric: tabular-nums; }
h2 { font-size: 1.3rem; margin: 3.2rem 0 1rem; padding-top: 1rem; border-top: 1px solid var(--faint); }
h3 { font-size: 1.05rem; }
p { margin: .5rem 0; max-width: 44rem; }
.kicker { font: 600 .75rem/1 var(--sans); letter-spacing: .09em; text-transform: uppercase; color: var(--soft); margin: 0 0 .9rem; }
.verdict { display: flex; flex-wrap: wrap; align-items: baseline; gap: .3rem .7rem; margin: 1.1rem 0 0; color: var(--soft); }
.badge { font: 600 .8rem/1 var(--sans); padding: .32em .7em .36em; border-radius: 99px; border: 1.5px solid; white-space: nowrap; }
.trusted { color: var(--trusted); } .weak { color: var(--weak); } .refused { color: var(--refused); }
.reasons { margin: 1rem 0 0; padding: .2rem 0 .2rem 1rem; border-left: 3px solid var(--faint); list-style: none; max-width: 44rem; }
.reasons li { margin: .3rem 0; }
.facts { display: grid; grid-template-columns: repeat(auto-fill, minmax(13.5rem, 1fr)); gap: 1.2rem 2rem; margin: 2.2rem 0 0; }
.facts dt { font: .78rem/1.3 var(--sans); color: var(--soft); }
.facts dd { margin: .1rem 0 0; font-variant-numeric: tabular-nums; overflow-wrap: break-word; }
.facts .wide { grid-column: 1 / -1; }
.equation { font-style: italic; font-size: 1.05rem; }
.equation span { font-style: normal; }
table { border-collapse: collapse; width: 100%; font: .88rem/1.4 var(--sans); font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; }
th { text-align: left; font-weight: 600; color: var(--soft); border-bottom: 1px solid var(--soft); padding: .35rem 1rem .35rem 0; vertical-align: bottom; }
td { border-bottom: 1px solid var(--faint); padding: .42rem 1rem .42rem 0; vertical-align: top; }
td:last-child, th:last-child { padding-right: 0; }
td.n { white-space: nowrap; }
tr.chosen td { font-weight: 600; }
.why { color: var(--soft); font-weight: 400; margin-left: .5em; }
td.span { width: 26%; min-width: 8rem; padding-top: .55rem; }
.span svg { display: block; width: 100%; overflow: visible; }
.span line { stroke: var(--c0); stroke-width: 2; }
.span .answer { stroke: var(--faint); stroke-width: 1.5; }
.span circle { fill: var(--c0); }
.matrix { width: auto; font-family: var(--mono); font-size: .8rem; border-left: 1.5px solid; border-right: 1.5px solid; }
.matrix td { border: 0; padding: .1rem .7rem; text-align: right; }
code, .hash { font-family: var(--mono); font-size: .82rem; overflow-wrap: anywhere; }
pre { font: .82rem/1.5 var(--mono); background: var(--wash); padding: .8rem 1rem; border-radius: 6px; white-space: pre-wrap; overflow-wrap: anywhere; margin: .5rem 0 1.2rem; }
figure { margin: 0 0 2.6rem; break-inside: avoid; }
figcaption p { color: var(--soft); font-size: .95rem; margin: .1rem 0 .7rem; }
figcaption .number { font: 600 .78rem/1 var(--sans); color: var(--soft); margin-right: .5em; }
.canvas { position: relative; font-family: var(--sans); margin-top: .4rem; }
.legend { display: flex; flex-wrap: wrap; gap: .1rem 1.1rem; font-size: .82rem; min-height: 1.5rem; font-variant-numeric: tabular-nums; margin-bottom: .25rem; }
.key { display: inline-flex; align-items: center; gap: .45em; background: none; border: 0; color: inherit; font: inherit; padding: .1em 0; }
.key i { width: 1.1em; height: 3px; border-radius: 2px; background: currentColor; flex: none; }
.key .value { color: var(--soft); }
.live .key { cursor: pointer; border-radius: 4px; }
.key[aria-pressed="false"] { opacity: .45; text-decoration: line-through; }
.key span { color: var(--ink); }
svg.chart { display: block; margin-left: var(--left); width: calc(100% - var(--left) - 10px); overflow: visible; font: 12px var(--sans); }
.frame { overflow: visible; pointer-events: none; }
.plot { overflow: hidden; }
.chart text { fill: var(--soft); font-variant-numeric: tabular-nums; }
.chart .y-name, .chart .x-name { fill: var(--ink); }
.x-name { text-anchor: end; }
.grid line { stroke: var(--faint); shape-rendering: crispEdges; }
.grid line.upright { opacity: .55; }
.grid text.x { text-anchor: middle; transform: translateY(18px); }
.grid text.y { text-anchor: end; dominant-baseline: central; }
.marks line { stroke: var(--ink); stroke-dasharray: 4 3; opacity: .65; }
.marks text { fill: var(--ink); paint-order: stroke; stroke: var(--paper); stroke-width: 4px; stroke-linejoin: round; }
.marks .left { text-anchor: end; transform: translateX(-6px); } .marks .right { transform: translateX(6px); }
.plot path { vector-effect: non-scaling-stroke; fill: none; stroke: currentColor; stroke-width: 1.5; stroke-linejoin: round; }
.plot path.dots { stroke-width: 6.5; stroke-linecap: round; } .plot path.dots.small { stroke-width: 4.5; } .plot path.dots.fine { stroke-width: 3; }
.plot path.segments { stroke-width: 1.25; opacity: .75; } .plot path.segments.fine { stroke-width: .75; opacity: .2; }
.plot path.band { fill: currentColor; stroke: none; opacity: .17; }
.plot path.columns { fill: currentColor; stroke: none; opacity: .85; }
.c0 { color: var(--c0); } .c1 { color: var(--c1); } .c2 { color: var(--c2); } .c3 { color: var(--c3); } .c4 { color: var(--c4); } .c5 { color: var(--c5); }
.live .plot { cursor: crosshair; touch-action: pan-y; }
.cursor { stroke: var(--soft); } .lens { fill: var(--c0); opacity: .12; }
.probe { stroke: var(--paper); stroke-width: 1.5; fill: currentColor; }
.back { position: absolute; right: 0; top: 0; font: .78rem var(--sans); color: var(--ink); background: var(--wash); border: 1px solid var(--faint); border-radius: 5px; padding: .2em .7em; cursor: pointer; }
.back[hidden] { display: none; }
.canvas:focus-visible, .key:focus-visible, .back:focus-visible { outline: 2px solid var(--c0); outline-offset: 3px; border-radius: 3px; }
.hint { display: none; font: .82rem/1.5 var(--sans); color: var(--soft); margin: -.4rem 0 1.4rem; } .live .hint { display: block; }
details { border-top: 1px solid var(--faint); padding: .8rem 0; } summary { cursor: pointer; font-weight: 600; }
footer { margin-top: 3rem; font: .8rem/1.5 var(--sans); color: var(--soft); }
@media (max-width: 36rem) {
  body { font-size: 16px; } main { padding: 1.6rem 1rem 2.5rem; } h2 { margin-top: 2.2rem; }
  .grid text.other { display: none; }
  .facts { grid-template-columns: 1fr 1fr; gap: .9rem 1.2rem; }
  td.span, th.span { display: none; } .why { display: block; margin: .3em 0 0; }
  .back { top: auto; bottom: 0; right: auto; left: 0; }
}
@media print {
  :root { color-scheme: light; --paper: #fff; --ink: #000; --soft: #444; --faint: #ccc; --wash: #f5f5f5;
    --trusted: #176b3a; --weak: #8a5300; --refused: #a3211f; --c0: #0f62ac; --c1: #d1490c; --c2: #11795a; --c3: #8a3ca6; --c4: #8a6a00; --c5: #56606b; }
  body { font-size: 10.5pt; } main { max-width: none; padding: 0; } .back, .live .hint { display: none; }
  h2 { break-after: avoid; } @page { margin: 18mm 16mm; }
}
)css";

}  // namespace takt::report
