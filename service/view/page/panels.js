// SPDX-License-Identifier: Apache-2.0
// The panels beside the pictures: objects, what changes over time, answers.

import { css, seriesColor } from './drawing.js';

export function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

// Copies what `text` returns. Where the page is no secure context, browsers have no clipboard for it.
async function copyText(text) {
  try { await navigator.clipboard.writeText(text); return true; } catch { /* the old way, then */ }
  const area = make('textarea', { value: text });
  document.body.append(area);
  area.select();
  let done = false;
  try { done = document.execCommand('copy'); } catch { /* it says that it did not */ }
  area.remove();
  return done;
}
export function copyButton(label, title, text) {
  const button = make('button', { className: 'copy', title, textContent: label, type: 'button' });
  button.addEventListener('click', async (e) => {
    e.stopPropagation();
    button.textContent = await copyText(text()) ? 'copied' : 'not copied';
    setTimeout(() => { button.textContent = label; }, 1500);
  });
  return button;
}
// A name that a table's program would take for a formula gets an apostrophe.
const csvName = (name) => '"' + (/^[=+\-@\t\r]/.test(name) ? "'" : '') + name.replaceAll('"', '""') + '"';
// Lines as {name, points: [[t, value, deviation?]...]}, all with the same times; one without points has empty cells.
export function csvOf(lines) {
  const columns = lines.flatMap(({ name, points }) => points.length && points[0].length > 2 ? [name, name + ' deviation'] : [name]);
  const longest = lines.reduce((most, { points }) => points.length > most.length ? points : most, []);
  const rows = longest.map(([t], i) => [t, ...lines.flatMap(({ points }) => (points[i] ?? [t, '']).slice(1))]);
  return [['time', ...columns].map(csvName), ...rows].map((row) => row.join(',')).join('\n') + '\n';
}

const units = { friction: '', restitution: '', mass: ' kg', impact_friction: '' };
const unitOf = (name) => units[name] ?? (name.startsWith('center_of_mass') ? ' m' : '');
const percent = (p) => (100 * p).toFixed(p > 0 && p < 0.01 ? 1 : 0) + ' %';
const stateKinds = { tracked: 'good', doubtful: 'warn', unseen: 'warn', lost: 'bad' };
const stateNames = ['tracked', 'doubtful', 'unseen', 'lost'];

// Rows are kept and only their texts change: a list that is built anew each frame can't be clicked.
export class ObjectList {
  constructor(root, onSelect) {
    this.root = root;
    this.onSelect = onSelect;
    this.rows = new Map();
  }
  row(object, color) {
    const row = make('div', { className: 'object', tabIndex: 0 });
    row.setAttribute('role', 'option');
    const dot = make('span', { className: 'dot' });
    dot.style.background = css(color);
    const made = { row, state: make('span', { className: 'badge' }), bar: make('i'), facts: make('dl', { className: 'facts' }) };
    made.bar.style.background = css(color);
    const meter = make('div', { className: 'meter', title: 'Confidence' }, made.bar);
    row.append(dot, make('span', { className: 'name', textContent: object.name }), made.state, meter, made.facts);
    row.addEventListener('click', () => this.onSelect(object.name));
    row.addEventListener('keydown', (e) => { if (e.key === 'Enter') this.onSelect(object.name); });
    return made;
  }
  show(objects, colors, selected) {
    const names = objects.map((o) => o.name).join('\n');
    if (names !== this.names) {
      this.names = names;
      this.rows = new Map(objects.map((o) => [o.name, this.row(o, colors.get(o.name))]));
      this.root.replaceChildren(...[...this.rows.values()].map((r) => r.row));
      if (!objects.length) this.root.replaceChildren(make('p', { className: 'hint', textContent: 'No object yet' }));
    }
    for (const object of objects) {
      const { row, state, bar, facts } = this.rows.get(object.name), chosen = object.name === selected;
      row.setAttribute('aria-selected', chosen);
      state.className = 'badge ' + stateKinds[object.state];
      state.textContent = object.state;
      bar.style.width = 100 * object.confidence + '%';
      const lines = [['confidence', percent(object.confidence)]];
      if (chosen) {
        const p = object.pose;
        if (object.held_by) lines.push(['held by', object.held_by]);
        lines.push(['position', p.slice(0, 3).map((c) => (100 * c).toFixed(1)).join(', ') + ' cm'],
          ['spread', (1000 * object.spread).toFixed(1) + ' mm'], ['speed', object.speed.toFixed(2) + ' m/s'],
          ['in view', percent(object.visible_share)], ['existence', percent(object.existence)]);
        for (const q of object.parameters)
          lines.push([q.name.replaceAll('_', ' '), q.mean.toFixed(3) + ' ± ' + q.deviation.toFixed(3) + unitOf(q.name)]);
        if (object.parameters.length)
          lines.push(['learned from', object.lessons === 0 ? 'nothing yet' : object.lessons === 1 ? '1 motion' : object.lessons + ' motions']);
      }
      const text = JSON.stringify(lines);
      if (facts.text === text) continue;
      facts.text = text;
      facts.replaceChildren(...lines.flatMap(([k, v]) => [make('dt', { textContent: k }), make('dd', { textContent: v })]));
    }
  }
}

// Lines over time with a band of one standard deviation, and the moment that is shown.
class Chart {
  constructor(title, onSeek) {
    this.value = make('b');
    this.lines = [];
    const copy = copyButton('CSV', 'Copy the curve', () => csvOf(this.lines));
    this.canvas = make('canvas');
    this.root = make('figure', { className: 'chart' }, make('figcaption', {}, make('span', { textContent: title }), make('span', {}, this.value, ' ', copy)), this.canvas);
    this.canvas.addEventListener('click', (e) => { if (this.range) onSeek(this.range[0] + (e.offsetX - this.left) / (this.canvas.clientWidth - this.left - 4) * (this.range[1] - this.range[0])); });
    this.left = 40;
  }
  // lines: [{name, color, points: [[t, value, deviation?]...], dashed}]
  draw(lines, range, now, limits, dark) {
    Object.assign(this, { range, lines });
    // What was not there yet has no value.
    lines = lines.map((line) => ({ ...line, points: line.points.filter(([, v]) => v !== null) }));
    const ratio = Math.min(2, devicePixelRatio || 1), { canvas, left } = this, w = canvas.clientWidth, h = canvas.clientHeight;
    if (!w) return;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio); }
    const g = canvas.getContext('2d');
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, w, h);
    let [low, high] = limits ?? [Infinity, -Infinity];
    if (!limits) {
      for (const { points } of lines) for (const [, v, d = 0] of points) { low = Math.min(low, v - d); high = Math.max(high, v + d); }
      if (!(high > low)) { low -= 0.05; high += 0.05; }
      const room = 0.08 * (high - low);
      low -= room; high += room;
    }
    const ink = dark ? '#a0a8b6' : '#5d6675', faint = dark ? '#343a45' : '#d9dce2', bottom = h - 16;
    const X = (t) => left + (t - range[0]) / Math.max(1e-9, range[1] - range[0]) * (w - left - 4);
    const Y = (v) => 8 + (high - v) / (high - low) * (bottom - 12);
    g.font = '11px system-ui, "DejaVu Sans", sans-serif';
    g.lineWidth = 1;
    for (let i = 0; i <= 2; ++i) {
      const v = low + i / 2 * (high - low), y = Math.round(Y(v)) + 0.5;
      g.strokeStyle = faint;
      g.beginPath(); g.moveTo(left, y); g.lineTo(w - 4, y); g.stroke();
      g.fillStyle = ink; g.textAlign = 'right'; g.textBaseline = 'middle';
      g.fillText(limits && limits[1] === 1 ? Math.round(100 * v) + ' %' : v.toFixed(Math.abs(high - low) < 0.2 ? 3 : 2), left - 4, y);
    }
    g.textBaseline = 'alphabetic';
    g.textAlign = 'left'; g.fillText(range[0].toFixed(1) + ' s', left, h - 3);
    g.textAlign = 'right'; g.fillText(range[1].toFixed(1) + ' s', w - 4, h - 3);
    for (const { color, points, dashed } of lines) {
      if (!points.length) continue;
      if (points[0].length > 2) {
        g.fillStyle = css(color, 0.18);
        g.beginPath();
        points.forEach(([t, v, d]) => g.lineTo(X(t), Y(v + d)));
        [...points].reverse().forEach(([t, v, d]) => g.lineTo(X(t), Y(v - d)));
        g.fill();
      }
      g.strokeStyle = css(color);
      g.lineWidth = 1.75;
      g.setLineDash(dashed ? [5, 4] : []);
      g.beginPath();
      points.forEach(([t, v]) => g.lineTo(X(t), Y(v)));
      g.stroke();
    }
    g.setLineDash([]);
    if (now === null) return;
    g.strokeStyle = ink; g.lineWidth = 1;
    g.beginPath(); g.moveTo(X(now), 2); g.lineTo(X(now), bottom); g.stroke();
  }
}

// Confidence of all objects, and each parameter of the one that is chosen.
export class Trends {
  constructor(root, onSeek) {
    this.root = root;
    this.onSeek = onSeek;
    this.charts = new Map();
    this.columns = [];
    this.rows = [];
  }
  setHistory(columns, rows) {
    this.columns = columns;
    this.rows = rows;
  }
  addRows(rows) {
    for (const row of rows) if (!this.rows.length || row[0] > this.rows[this.rows.length - 1][0]) this.rows.push(row);
    if (this.rows.length > 8000) this.rows = this.rows.filter((_, i) => i % 2 === 0);
  }
  // A step as a row of the history.
  rowOf(step) {
    const values = step.objects.flatMap((o) => [stateNames.indexOf(o.state), o.confidence, o.existence, ...o.parameters.flatMap((p) => [p.mean, p.deviation])]);
    return values.length === this.columns.length ? [step.index, step.time, ...values] : null;
  }
  get range() {
    return this.rows.length ? [this.rows[0][1], Math.max(this.rows[0][1] + 0.1, this.rows[this.rows.length - 1][1])] : [0, 1];
  }
  indexAt(time) {
    let best = this.rows[0];
    for (const row of this.rows) if (Math.abs(row[1] - time) < Math.abs(best[1] - time)) best = row;
    return best ? best[0] : 0;
  }
  column(name) { return this.columns.indexOf(name); }
  points(name, deviation) {
    const i = this.column(name), d = deviation ? this.column(name + '/deviation') : -1;
    if (i < 0) return [];
    const every = Math.max(1, Math.floor(this.rows.length / 1000));
    return this.rows.filter((_, k) => k % every === 0 || k === this.rows.length - 1).map((r) => d < 0 ? [r[1], r[i + 2]] : [r[1], r[i + 2], r[d + 2]]);
  }
  show(step, colors, selected, dark) {
    const wanted = [['Confidence', null]];
    const object = step.objects.find((o) => o.name === selected);
    for (const p of object ? object.parameters : []) wanted.push([object.name + ': ' + p.name.replaceAll('_', ' '), p]);
    const key = wanted.map(([t]) => t).join('\n');
    if (key !== this.key) {
      this.key = key;
      this.charts = new Map(wanted.map(([title]) => [title, new Chart(title, (t) => this.onSeek(this.indexAt(t)))]));
      this.root.replaceChildren(...[...this.charts.values()].map((c) => c.root));
    }
    const { range } = this;
    for (const [title, parameter] of wanted) {
      const chart = this.charts.get(title);
      const lines = parameter
        ? [{ name: title, color: colors.get(object.name), points: this.points(object.name + '/' + parameter.name, true) }]
        : step.objects.map((o) => ({ name: o.name, color: colors.get(o.name), points: this.points(o.name + '/confidence'), dashed: o.name !== selected && step.objects.length > 1 }));
      chart.value.textContent = parameter ? parameter.mean.toFixed(3) + ' ± ' + parameter.deviation.toFixed(3) + unitOf(parameter.name) : object ? percent(object.confidence) : '';
      chart.draw(lines, range, step.time, parameter ? null : [0, 1], dark);
    }
  }
}

// Colour of each outcome, by its place in its group: the same in bars, in the scene and in the reports.
const outcomeKey = ({ group, name, outcome }) => (group ?? '') + '/' + (name ?? outcome);
function outcomeColors(predict) {
  const places = new Map(), colors = new Map();
  for (const outcome of predict.outcomes) {
    const place = places.get(outcome.group) ?? 0;
    places.set(outcome.group, place + 1);
    colors.set(outcomeKey(outcome), seriesColor(place + 1));
  }
  return colors;
}

// Of a prediction, what the scene shows: the ends and the runs of the outcomes that exclude each other, those of the
// first group of them.
export function shownEnds(predict) {
  const first = predict.outcomes.find((o) => o.group) ?? predict.outcomes[0], colors = outcomeColors(predict);
  if (!first) return { runs: [], ends: [] };
  const colorOf = (name) => colors.get(outcomeKey({ group: first.group, name })) ?? [128, 128, 128];
  return {
    runs: (predict.typical_runs ?? []).filter((run) => run.group === first.group).map((run) => ({ run, color: colorOf(run.outcome) })),
    ends: (predict.final_poses ?? []).map((end) => ({ end, colorOf })),
  };
}

function outcomeRow({ name, probability, interval }, color) {
  const fill = make('i'), whisker = make('u'), [low, high] = interval ?? [probability, probability];
  fill.style.width = 100 * probability + '%';
  fill.style.background = css(color);
  whisker.style.left = 100 * low + '%';
  whisker.style.width = 100 * (high - low) + '%';
  return make('div', { className: 'outcome', title: `${percent(low)} to ${percent(high)}` }, make('span', { textContent: name }),
    make('span', { className: 'bar' }, fill, whisker), make('output', { textContent: percent(probability) }));
}

export function answerContent(answer) {
  const nodes = [];
  const note = (text, className = '') => nodes.push(make('p', { className, textContent: text }));
  if (answer.error) { note(answer.error, 'bad'); return nodes; }
  const { where, stability, predict } = answer;
  if (where) {
    for (const { object, state, estimate } of where.items)
      note(`${object}: ${state}, ${percent(estimate.confidence)} sure, at ${estimate.mean.position.map((c) => (100 * c).toFixed(1)).join(', ')} cm`);
  } else if (stability) {
    nodes.push(outcomeRow({ ...stability.stable, name: stability.object + ' stays' }, seriesColor(1)));
    if (stability.likely_event) note('Otherwise: ' + stability.likely_event);
  } else if (predict) {
    const colors = outcomeColors(predict);
    let group = '';
    for (const outcome of predict.outcomes) {
      if (outcome.group !== group) nodes.push(make('div', { className: 'group', textContent: outcome.group || 'each by itself' }));
      group = outcome.group;
      if (outcome.probability < 0.005 && outcome.name === 'other') continue;
      nodes.push(outcomeRow(outcome, colors.get(outcomeKey(outcome))));
    }
  } else note(JSON.stringify(answer).slice(0, 600));
  const based = stability ?? predict;
  if (based) {
    note(`From ${based.instances} simulated runs in ${based.wall_seconds.toFixed(1)} s`);
    for (const remark of based.remarks ?? []) note(remark);
  }
  return nodes;
}
