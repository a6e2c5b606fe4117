/* Draws every `.chart` of the page: a <script type="application/json"> in it says what.

   The text is that of `workbench/report/chart.py` (`chart_data`), which documents it. Needs uPlot before
   it, and nothing of the page's own: it may be inlined or served as a file, also where a content security
   policy allows no inline script. `servoCharts.draw(root)` draws charts that joined the page later. */
"use strict";
const servoCharts = (() => {
  const HEIGHT = 220, PRINTED_WIDTH = 660, NARROW = 520;
  const drawn = new Set();
  let printing = false;

  const token = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const colour = (name, alpha = "") => token(name) + alpha;

  function numbers(coded) {
    if (coded.step !== undefined) {
      const x = new Float64Array(coded.count);
      for (let k = 0; k < x.length; k++) x[k] = coded.start + k * coded.step;
      return x;
    }
    const text = atob(coded.base64), bytes = new Uint8Array(text.length);
    for (let k = 0; k < bytes.length; k++) bytes[k] = text.charCodeAt(k);
    const values = coded.type === "f8" ? new Float64Array(bytes.buffer) : new Float32Array(bytes.buffer);
    return values.some(Number.isNaN) ? Array.from(values, (v) => (Number.isNaN(v) ? null : v)) : values;
  }

  /* Four digits and no exponent, however small or large. */
  function shown(value) {
    if (value === null || value === undefined) return "";
    if (value === 0) return "0";
    const digits = 3 - Math.floor(Math.log10(Math.abs(value)));
    return value.toFixed(Math.min(Math.max(digits, 0), 9));
  }

  function seriesOf(panel, rows) {
    const list = [{label: panel.x, value: (u, v) => shown(v), class: panel.x ? "chart-x" : "chart-unseen"}];
    const fills = [];
    const kind = (line) => {
      if (!line.name || (line.look === "edge" && !line.upper)) return "chart-unseen";
      return line.look === "edge" ? `chart-shade-${line.colour}` : `chart-${line.look}-${line.colour}`;
    };
    for (const line of panel.lines) {
      const dots = line.look === "dots", edge = line.look === "edge";
      list.push({
        label: line.name, value: (u, v) => shown(v),
        class: kind(line),
        stroke: edge ? undefined : () => colour(line.colour),
        width: dots || edge ? 0 : line.look === "bold" ? 2 : 1.3,
        dash: {dashed: [7, 4], dotted: [2, 3]}[line.look],
        paths: dots ? () => null : undefined,
        points: dots
          ? {show: true, size: rows > 200 ? 3 : 7, width: 0, fill: () => colour(line.colour, "90"), stroke: "transparent"}
          : {show: false},
      });
      if (edge && line.upper) fills.push([list.length - 1, line]);
    }
    for (const band of panel.bands)
      list.push({label: band.name, value: () => "", class: `chart-shade-${band.colour}`, points: {show: false}});
    const bands = fills.map(([at, line]) => ({series: [at, at - 1], fill: () => colour(line.colour, "55")}));
    return [list, bands];
  }

  function dataOf(panel) {
    const tables = panel.tables.map((t) => [numbers(t.x), ...t.y.map(numbers)]);
    const data = tables.length > 1 ? uPlot.join(tables) : tables[0];
    return [...data, ...panel.bands.map(() => new Array(data[0].length).fill(null))];
  }

  /* Stretches of x lie below the lines; those of y above, since noise would hide them. */
  function shading(panel, axis) {
    return (u) => {
      const {left, top, width, height} = u.bbox, c = u.ctx;
      c.save();
      c.beginPath(); c.rect(left, top, width, height); c.clip();
      for (const band of panel.bands.filter((one) => one.axis === axis)) {
        const [a, b] = [band.low, band.high].map((v) => u.valToPos(v, axis, true));
        const begin = Math.min(a, b), wide = Math.max(Math.abs(b - a), 1);
        c.fillStyle = colour(band.colour, "38");
        if (axis === "x") c.fillRect(begin, top, wide, height);
        else {
          c.fillRect(left, begin, width, wide);
          c.strokeStyle = colour(band.colour); c.lineWidth = devicePixelRatio; c.setLineDash([]);
          c.strokeRect(left - 2, begin, width + 4, wide);
        }
      }
      c.strokeStyle = colour("quiet"); c.lineWidth = devicePixelRatio; c.setLineDash([5, 4]);
      for (const mark of panel.marks.filter((one) => one.axis === axis)) {
        const at = u.valToPos(mark.at, axis, true);
        c.beginPath();
        if (axis === "x") { c.moveTo(at, top); c.lineTo(at, top + height); }
        else { c.moveTo(left, at); c.lineTo(left + width, at); }
        c.stroke();
      }
      c.restore();
    };
  }

  function axisOf(label, more) {
    return {
      label, stroke: () => colour("ink"), font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif",
      grid: {stroke: () => colour("grid"), width: 1}, ticks: {stroke: () => colour("grid"), width: 1}, ...more,
    };
  }

  /* The range given for the whole; where the eye has zoomed in, that of what is seen. */
  function yRange(panel, whole) {
    return (u, low, high) => {
      const seen = u.scales.x;
      const all = seen.min === null || (seen.min <= whole[0] && seen.max >= whole[1]);
      if (panel.y_range && all) return panel.y_range;
      if (low === null) return panel.y_range || [panel.log_y ? 0.1 : 0, 1];
      if (panel.log_y) return [low / 1.5, high * 1.5];
      const pad = 0.06 * (high - low) || Math.abs(0.1 * high) || 1;
      return [low - pad, high + pad];
    };
  }

  /* Names in place of numbers at 0, 1, ... of x. */
  function named(panel) {
    if (!panel.names.length) return {};
    const at = () => panel.names.map((_, k) => k);
    return {size: 56, rotate: -30, splits: at, values: (u, ticks) => ticks.map((v) => panel.names[v])};
  }

  function optionsOf(panel, width, data, sync, onZoom) {
    const [series, bands] = seriesOf(panel, data[0].length);
    const first = data[0][0], last = data[0][data[0].length - 1];
    const whole = panel.x_range || [first, last];
    const xRange = (u, low, high) => (low === null || (low === first && high === last) ? whole : [low, high]);
    const plain = (u, ticks) => ticks.map((v) => (v === null ? "" : String(+v.toPrecision(6))));
    return {
      width, height: panel.height || HEIGHT, series, bands,
      legend: {live: true}, cursor: {sync: sync ? {key: sync, setSeries: false} : undefined, drag: {x: true, y: false}},
      scales: {
        x: {time: false, distr: panel.log_x ? 3 : 1, range: xRange},
        y: {distr: panel.log_y ? 3 : 1, range: yRange(panel, whole)},
      },
      axes: [
        axisOf(panel.x || null, {size: 30, labelSize: 18, ...(panel.log_x ? {} : {values: plain}), ...named(panel)}),
        axisOf(panel.y, {size: 58, labelSize: 18, ...(panel.log_y ? {} : {values: plain})}),
      ],
      hooks: {drawAxes: [shading(panel, "x")], draw: [shading(panel, "y")], setScale: [(u, key) => key === "x" && onZoom(u)]},
      whole,
    };
  }

  function button(text, meaning, act) {
    const made = document.createElement("button");
    made.type = "button"; made.textContent = text; made.title = meaning;
    made.setAttribute("aria-label", meaning);
    made.addEventListener("click", act);
    return made;
  }

  /* Zoom by buttons too: for fingers and for the keyboard. */
  function toolsOf(chart, say) {
    const tools = document.createElement("div");
    tools.className = "chart-tools";
    const by = (left, right) => () => {
      const {scales: {x}, whole: [begin, end]} = chart.plots[0], span = x.max - x.min;
      // Moved no further than the ends, and by the same on both sides where it is moved.
      const most = left === right ? Math.min(Math.max(left * span, begin - x.min), end - x.max) : 0;
      say(left === right ? [x.min + most, x.max + most] : [x.min + left * span, x.max + right * span]);
    };
    tools.append(
      button("+", "zoom in", by(0.25, -0.25)), button("−", "zoom out", by(-0.5, 0.5)),
      button("◀", "further left", by(-0.4, -0.4)), button("▶", "further right", by(0.4, 0.4)),
      button("whole", "show the whole", () => say(null)),
    );
    if (chart.parts.length) {
      const list = document.createElement("select");
      list.setAttribute("aria-label", "part shown");
      list.append(new Option("go to ...", ""), ...chart.parts.map((p, k) => new Option(p.name, k)));
      list.addEventListener("change", () => say(list.value === "" ? null : [chart.parts[+list.value].low, chart.parts[+list.value].high]));
      tools.append(list);
    }
    tools.append("drag over the chart to zoom, double-click for the whole");
    return tools;
  }

  function drawOne(root) {
    const chart = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
    const panels = root.querySelector(".chart-panels");
    chart.plots = [];
    let busy = false;
    const zoomAll = (range, from) => {
      if (busy) return;
      busy = true;
      for (const plot of chart.plots) {
        if (plot === from || (from && !chart.shared_x)) continue;
        const [low, high] = range || plot.whole;
        const min = Math.max(low, plot.whole[0]), max = Math.min(high, plot.whole[1]);
        if (min < max) plot.setScale("x", {min, max});
      }
      busy = false;
    };
    const boxes = chart.panels.map((panel) => {
      const box = document.createElement("div");
      box.className = "chart-panel";
      if (panel.title) {
        const title = document.createElement("div");
        title.className = "chart-title"; title.textContent = panel.title;
        box.append(title);
      }
      panels.append(box);
      return box;
    });
    chart.panels.forEach((panel, k) => {
      const data = dataOf(panel);
      const settled = () => chart.plots.length === chart.panels.length;
      const onZoom = (u) => settled() && zoomAll([u.scales.x.min, u.scales.x.max], u);
      const sync = chart.shared_x && chart.panels.length > 1 ? chart.name : null;
      const options = optionsOf(panel, Math.max(boxes[k].clientWidth, 200), data, sync, onZoom);
      const plot = new uPlot(options, data, boxes[k]);
      plot.whole = options.whole;
      plot.root.addEventListener("dblclick", () => zoomAll(null));
      chart.plots.push(plot);
    });
    chart.fit = () => chart.plots.forEach((plot, k) => {
      const wide = printing ? PRINTED_WIDTH / (panels.classList.contains("two") ? 2.1 : 1) : boxes[k].clientWidth;
      const high = (chart.panels[k].height || HEIGHT) * (wide < NARROW ? 0.85 : 1);
      if (wide > 0 && (wide !== plot.width || high !== plot.height)) plot.setSize({width: wide, height: high});
      else plot.redraw(false, true);
    });
    panels.after(toolsOf(chart, zoomAll));
    new ResizeObserver(() => printing || chart.fit()).observe(panels);
    root.dataset.drawn = Math.round(performance.now());
    drawn.add(chart);
  }

  const redraw = () => drawn.forEach((chart) => chart.fit());
  function draw(root = document) {
    // One after the other, so that the first is on the screen before the last is read.
    const next = () => {
      const one = root.querySelector(".chart:not([data-drawn])");
      if (!one) return;
      drawOne(one);
      setTimeout(next);
    };
    next();
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  matchMedia("print").addEventListener("change", (e) => { printing = e.matches; redraw(); });
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", () => draw());
  else draw();
  return {draw};
})();
