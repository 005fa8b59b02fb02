// SPDX-License-Identifier: Apache-2.0
// What state each object was in, as bands over time, and the changes between them.

import { css, seriesColor } from './drawing.js';
import { make } from './panels.js';

// The colours of the reports' bands, from good to bad.
const stateColors = { tracked: seriesColor(2), doubtful: seriesColor(5), unseen: seriesColor(1), lost: seriesColor(3) };
const laneHeight = 13, inset = 8, mostListed = 300;

// What a run began with, said against the run before it; null where nothing came before.
export function changeText(name, before, run) {
  const said = [];
  if (before.state !== run.state) said.push(before.state + ', then ' + run.state);
  if (before.heldBy !== run.heldBy) said.push(run.heldBy ? 'held by ' + run.heldBy : 'let go by ' + before.heldBy);
  return name + ': ' + said.join('; ');
}

// Across, steps are evenly spread, as they are along the slider beneath.
export class Bands {
  constructor({ root, details, list, onSeek, onSelect }) {
    Object.assign(this, { root, details, list, onSeek, onSelect, objects: [], runs: [], events: [], newest: new Map(), steps: 0, first: 0, shortest: 0, joined: 0, forgotten: 0 });
    this.canvas = make('canvas');
    root.replaceChildren(this.canvas);
    const { canvas } = this;
    canvas.addEventListener('pointerdown', (e) => {
      canvas.setPointerCapture(e.pointerId);
      const lane = this.laneAt(e), event = this.eventAt(e);
      if (this.objects[lane] !== undefined) onSelect(this.objects[lane]);
      onSeek(event ? event.index : this.indexAt(e));
    });
    canvas.addEventListener('pointermove', (e) => {
      if (e.buttons & 1) return onSeek(this.indexAt(e));
      const event = this.eventAt(e), run = this.runAt(this.laneAt(e), this.indexAt(e));
      canvas.title = event ? event.time.toFixed(2) + ' s, ' + event.text
        : run ? this.objects[run.object] + ': ' + run.state + (run.heldBy ? ', held by ' + run.heldBy : '') + ' from ' + run.time.toFixed(2) + ' s' : '';
    });
  }
  set({ objects = [], runs = [], shortest_run: shortest = 0, joined_runs: joined = 0, forgotten_steps: forgotten = 0, left_out_objects: leftOut = 0 }) {
    Object.assign(this, { objects, runs: [], events: [], shortest, joined, forgotten, leftOut });
    this.list.replaceChildren();
    this.newest = new Map();
    this.add(runs);
  }
  add(runs = []) {
    for (const [object, index, time, state, heldBy] of runs) {
      const run = { object, index, time, state, heldBy }, before = this.newest.get(object);
      if (before && index <= before.index) continue;  // the history that came just before has it already
      this.runs.push(run);
      this.newest.set(object, run);
      if (before) this.events.push({ object, index, time, text: changeText(this.objects[object], before, run) });
    }
    this.listEvents();
  }
  // The newest, if there are many: the bands have all.
  listEvents() {
    const shown = this.events.slice(-mostListed), left = this.events.length - shown.length;
    this.details.hidden = !this.events.length && !this.forgotten && !this.leftOut;
    this.details.firstElementChild.textContent = this.events.length === 1 ? '1 change of a state' : this.events.length + ' changes of states';
    for (const note of this.details.querySelectorAll('.note')) note.remove();
    const note = (text) => this.details.insertBefore(make('p', { className: 'note', textContent: text }), this.list);
    if (left) note('The last ' + shown.length + ' of them');
    if (this.forgotten) note('Of the first ' + this.forgotten + ' steps there are no curves and states: something was no longer there, or the clock went back');
    if (this.leftOut) note(this.leftOut + ' objects have no curves and states: there are too many, or their names are too long');
    if (this.joined) note(this.joined + ' states that lasted less than ' + this.shortest.toFixed(1) + ' s are left out');
    this.list.replaceChildren(...shown.map((event) => {
      const button = make('button', { textContent: event.time.toFixed(2) + ' s, ' + event.text });
      button.addEventListener('click', () => { this.onSelect(this.objects[event.object]); this.onSeek(event.index); });
      event.button = button;
      return make('li', {}, button);
    }));
    this.current = null;
  }
  // The change before (-1) or after (+1) a step; null where there is none.
  neighbour(index, direction) {
    const on = this.events.filter((e) => direction > 0 ? e.index > index : e.index < index);
    return on.length ? on.reduce((a, b) => (direction > 0 ? b.index < a.index : b.index > a.index) ? b : a) : null;
  }
  get last() { return Math.max(this.first + 1, this.steps - 1); }
  xOf(index) { return inset + (index - this.first) / (this.last - this.first) * (this.canvas.clientWidth - 2 * inset); }
  indexAt(e) {
    const share = (e.offsetX - inset) / Math.max(1, this.canvas.clientWidth - 2 * inset);
    return Math.round(this.first + Math.min(1, Math.max(0, share)) * (this.last - this.first));
  }
  laneAt(e) { return Math.floor(e.offsetY / laneHeight); }
  runAt(lane, index) { return this.runs.findLast((run) => run.object === lane && run.index <= index); }
  eventAt(e) {
    const lane = this.laneAt(e);
    let best = null;
    for (const event of this.events) {
      const away = event.object === lane ? Math.abs(this.xOf(event.index) - e.offsetX) : Infinity;
      if (away < 6 && (!best || away < best.away)) best = { away, event };
    }
    return best && best.event;
  }
  draw({ index, steps, first, selected, dark, fixed }) {
    Object.assign(this, { steps, first });
    const { canvas, root } = this;
    root.hidden = !this.runs.length;
    root.classList.toggle('fixed', fixed);
    if (root.hidden) return;
    const height = laneHeight * this.objects.length, ratio = Math.min(2, devicePixelRatio || 1);
    canvas.style.height = height + 'px';
    const w = canvas.clientWidth;
    if (!w) return;
    if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(height * ratio)) { canvas.width = Math.round(w * ratio); canvas.height = Math.round(height * ratio); }
    const g = canvas.getContext('2d'), ink = dark ? '#e8eaee' : '#1d2129', back = dark ? '#14171c' : '#f3f4f6';
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, w, height);
    const ends = new Array(this.objects.length).fill(this.last);
    for (const run of [...this.runs].reverse()) {
      const end = ends[run.object], x = Math.max(inset, this.xOf(run.index)), top = run.object * laneHeight + 1;
      ends[run.object] = run.index;
      if (end < first) continue;
      const width = Math.max(1, this.xOf(end) - x);
      g.fillStyle = css(stateColors[run.state] ?? [128, 128, 128], this.objects[run.object] === selected ? 1 : 0.7);
      g.fillRect(x, top, width, laneHeight - 2);
      if (run.heldBy) { g.fillStyle = ink; g.fillRect(x, top + laneHeight - 5, width, 3); }
    }
    g.fillStyle = ink;
    for (const event of this.events) if (event.index >= first) g.fillRect(Math.round(this.xOf(event.index)), event.object * laneHeight, 1, laneHeight);
    g.font = '10px system-ui, "DejaVu Sans", sans-serif';
    g.textBaseline = 'middle';
    this.objects.forEach((name, i) => {
      g.lineWidth = 3; g.strokeStyle = back; g.fillStyle = ink;
      g.strokeText(name.slice(0, 40), inset + 3, (i + 0.5) * laneHeight + 0.5);
      g.fillText(name.slice(0, 40), inset + 3, (i + 0.5) * laneHeight + 0.5);
    });
    g.fillRect(Math.round(this.xOf(index)) - 1, 0, 2, height);
    this.mark(index);
  }
  // In the list, the newest change that has happened by the step.
  mark(index) {
    const current = this.events.findLast((e) => e.index <= index) ?? null;
    if (current === this.current) return;
    if (this.current && this.current.button) this.current.button.removeAttribute('aria-current');
    if (current && current.button) current.button.setAttribute('aria-current', 'true');
    this.current = current;
  }
}

// What the colours of the bands mean.
export function bandKey() {
  const entry = (color, text) => { const key = make('i', { className: 'key' }); key.style.background = color; return [key, text]; };
  return make('p', {}, ...Object.entries(stateColors).flatMap(([state, color]) => entry(css(color), state)), ...entry('currentColor', 'held: the line beneath'));
}
