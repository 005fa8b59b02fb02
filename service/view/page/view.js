// SPDX-License-Identifier: Apache-2.0
// The live view: talks to the program, and shows a step of the belief. docs/reference/live_view.md has the messages.

import { seriesColor, css } from './drawing.js';
import { OverlayView, SpaceView } from './scene3d.js';
import { ObjectList, Trends, answerContent, copyButton, make, shownEnds } from './panels.js';
import { Bands, bandKey } from './bands.js';
import { RecordedProgram } from './recorded.js';

const $ = (id) => document.getElementById(id);
const page = {
  mode: 'live', scene: null, step: null, steps: 0, done: true, selected: null, ghosts: true, overlay: true, shownAnswer: null,
  playing: false, following: true, waitingFor: null, wanted: null, colors: new Map(), indexes: new Map(), strips: new Map(),
  cameras: [], camera: 0, pictures: new Map(),  // of several cameras: their names, which is shown, and the newest picture of each
};
let socket = null, nextNumber = 1, retry = 500, drawing = false;
const asked = new Map();  // number -> {text, element, answer}

const dark = () => document.documentElement.dataset.theme === 'dark';
const space = new SpaceView($('space'), $('labels'), (x, y) => { const name = page.step && space.pick(page.step, x, y); if (name) select(name); });
const overlay = new OverlayView($('outlines'));
const list = new ObjectList($('object-list'), select);
const trends = new Trends($('charts'), (index) => seek(index));
const bands = new Bands({ root: $('bands'), details: $('happened'), list: $('events'), onSeek: (index) => seek(index), onSelect: select });
$('happened').append(bandKey());
const photo = $('photo').getContext('2d');
if (!space.works) $('labels').replaceChildren(make('p', { className: 'hint', textContent: 'This browser has no WebGL 2: the scene is not drawn' }));

// --- talking to the program

// In a report, the file stands for the program.
const recorded = $('recorded') && new RecordedProgram(JSON.parse($('recorded').textContent), take, takePicture);

function connect() {
  if (recorded) return openRecorded();
  socket = new WebSocket((location.protocol === 'https:' ? 'wss://' : 'ws://') + location.host + '/', 'prescene.view.v1');
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => { retry = 500; setState('connected', 'good'); };
  socket.onclose = () => {
    setState('not connected', 'bad');
    Object.assign(page, { waitingFor: null });
    setTimeout(connect, retry);
    retry = Math.min(8000, 2 * retry);
  };
  socket.onmessage = ({ data }) => typeof data === 'string' ? take(JSON.parse(data)) : takePicture(data);
}
function openRecorded() {
  const remedy = 'Questions need the program: prescene view RECORDING';
  for (const button of document.querySelectorAll('.asks button, #ask-own')) Object.assign(button, { disabled: true, title: remedy });
  document.querySelector('#questions details').hidden = true;
  if (!recorded.data.answers.length) $('answers').append(make('p', { textContent: remedy }));
  recorded.open();
  for (const { time, index, answer } of [...recorded.data.answers].reverse()) {
    const kind = Object.keys(answer).find((key) => typeof answer[key] === 'object') ?? 'answer';
    const number = addAnswer(kind, time.toFixed(2) + ' s');
    asked.get(number).element.addEventListener('click', () => seek(index));
    fillAnswer(number, answer);
  }
}
function say(request) {
  if (recorded) { if (request.op === 'show') recorded.show(request.index, request.camera); return; }
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(request));
}
function setState(text, kind) {
  $('state').textContent = text;
  $('state').className = 'badge ' + kind;
}

const receivers = {
  hello({ mode, title }) {
    page.mode = mode;
    $('source').textContent = title ?? '';
    document.title = (title ? title + ' - ' : '') + 'Prescene';
    for (const id of ['back', 'on', 'speed', 'scrub']) $(id).hidden = mode === 'live';
    $('play').textContent = mode === 'live' ? 'Pause' : 'Play';
    page.playing = mode === 'live';
    page.following = true;
    page.strips.clear();
    setState(mode === 'live' ? 'live' : 'recording', 'good');
  },
  scene(scene) {
    page.scene = scene;
    setCameras(scene.cameras);
    if (page.mode === 'live') $('source').textContent = scene.name;
    space.setScene(scene);
    overlay.setScene(scene);
    redraw();
  },
  history(history) { trends.setHistory(history.columns, history.rows); bands.set(history); redraw(); },
  rows({ rows, runs }) { trends.addRows(rows); if (runs && runs.length) bands.add(runs); redraw(); },
  step(step) {
    page.waitingFor = null;
    if (page.mode === 'live') {
      page.steps = step.index + 1;
      const row = trends.rowOf(step);
      if (row) trends.addRows([row]);
      if (!page.playing && page.step) return;
    }
    showStep(step);
    if (page.wanted !== null && page.wanted !== step.index) request(page.wanted);
    else page.wanted = null;
  },
  extent({ steps, done, progress, remarks }) {
    const first = page.steps === 0 && steps > 0;
    Object.assign(page, { steps, done });
    $('scrub').max = Math.max(0, steps - 1);
    setState(done ? 'recording' : 'replaying ' + Math.round(100 * progress) + ' %', done ? 'good' : 'warn');
    $('health').textContent = remarks.join(' ');
    $('health').title = remarks.join('\n');
    if (first) request(0);
    else if (page.step) drawStrip();
    redraw();
  },
  answer({ number, answer }) { showAnswer(number, answer); },
  health({ text }) { $('health').textContent = text; $('health').title = text; },
};
function take(message) {
  const receive = receivers[message.op];
  if (receive) receive(message);
}

async function takePicture(data) {
  const view = new DataView(data), kind = view.getUint8(0), camera = view.getUint8(1), index = Number(view.getBigUint64(8, true));
  if (kind === 1 && page.mode === 'live' && !page.playing && page.step) return;
  let picture;
  try { picture = await createImageBitmap(new Blob([new Uint8Array(data, 16)], { type: 'image/jpeg' })); } catch { return; }
  if (kind === 2) { page.strips.set(index, picture); if (page.strips.size > 140) page.strips.delete(page.strips.keys().next().value); drawStrip(); return; }
  page.pictures.set(camera, picture);
  showPicture();
}

// The newest of the camera that is chosen.
function showPicture() {
  const picture = page.pictures.get(page.camera), { canvas } = photo;
  $('photo-hint').hidden = !!picture;
  canvas.hidden = !picture;
  if (!picture) return redraw();
  if (canvas.width !== picture.width || canvas.height !== picture.height) { canvas.width = picture.width; canvas.height = picture.height; }
  photo.drawImage(picture, 0, 0);
  page.pictureSize = [picture.width, picture.height];
  redraw();
}

// --- cameras

function setCameras(names) {
  if (names.join('\n') === page.cameras.join('\n')) return;
  page.cameras = names;
  $('which').replaceChildren(...names.map((name, i) => make('option', { value: i, textContent: name })));
  $('which').hidden = names.length < 2;
  setCamera(0);
}
function setCamera(camera) {
  page.camera = camera;
  $('which').value = camera;
  if (page.step) page.step = seenBy(page.step);
  showPicture();
  if (page.step && page.mode !== 'live') request(page.step.index);
}
// The step with the camera that is chosen as its camera; one that has given no frame yet has no width.
function seenBy(step) {
  if (!step.cameras) return step;
  return { ...step, camera: step.cameras[page.camera] ?? { ...step.camera, width: 0 } };
}

// --- showing

function showStep(step) {
  page.step = seenBy(step);
  step.objects.forEach((o) => {
    if (page.colors.has(o.name)) return;
    page.indexes.set(o.name, page.colors.size);
    page.colors.set(o.name, seriesColor(page.colors.size));
  });
  if (!step.objects.some((o) => o.name === page.selected)) page.selected = step.objects.length ? step.objects[0].name : null;
  redraw();
}
function select(name) { page.selected = name; redraw(); }

// At most once a frame of the screen, however much has come.
function redraw() {
  if (drawing) return;
  drawing = true;
  requestAnimationFrame(() => {
    drawing = false;
    const { step } = page;
    layoutPicture();
    if (!step) return;
    const shown = page.shownAnswer && page.shownAnswer.predict ? shownEnds(page.shownAnswer.predict) : null;
    space.draw(step, { dark: dark(), ghosts: page.ghosts, selected: page.selected, colors: page.colors, answer: shown });
    // Outlines of one step do not fit the picture of another.
    if (page.overlay && !step.pictureAge) overlay.draw(step, page.indexes);
    else overlay.clear();
    list.show(step.objects, page.colors, page.selected);
    trends.show(step, page.colors, page.selected, dark());
    const isLive = page.mode === 'live';
    bands.draw({ index: step.index, steps: page.steps, first: isLive && trends.rows.length ? trends.rows[0][0] : 0, selected: page.selected, dark: dark(), fixed: isLive });
    $('scrub').value = page.mode === 'live' ? $('scrub').max : step.index;
    const age = step.pictureAge ?? 0;
    $('clock').textContent = step.time.toFixed(2) + ' s' + (age ? ' (picture ' + Math.abs(age) + ' steps ' + (age > 0 ? 'older' : 'newer') + ')' : '') + ', step ' + step.step;
  });
}

// The picture and its outlines fill the panel, undistorted.
function layoutPicture() {
  const box = $('camera'), size = page.pictureSize ?? (page.step && page.step.camera.width ? [page.step.camera.width, page.step.camera.height] : [4, 3]);
  const factor = Math.min(box.clientWidth / size[0], box.clientHeight / size[1]), w = size[0] * factor, h = size[1] * factor;
  for (const canvas of [$('photo'), $('outlines')]) {
    canvas.style.width = w + 'px';
    canvas.style.height = h + 'px';
    canvas.style.left = (box.clientWidth - w) / 2 + 'px';
    canvas.style.top = (box.clientHeight - h) / 2 + 'px';
  }
}

function drawStrip() {
  const strip = $('strip'), entries = [...page.strips].sort((a, b) => a[0] - b[0]);
  if (!entries.length) return;
  const first = page.mode === 'live' ? entries[0][0] : 0, last = Math.max(page.steps - 1, entries[entries.length - 1][0], first + 1);
  const height = strip.clientHeight, width = height * entries[0][1].width / entries[0][1].height;
  const places = Math.max(1, Math.floor(strip.clientWidth / width)), nodes = [];
  for (let i = 0; i < places; ++i) {
    const wanted = first + (i + 0.5) / places * (last - first);
    const [, picture] = entries.reduce((a, b) => Math.abs(b[0] - wanted) < Math.abs(a[0] - wanted) ? b : a);
    const canvas = make('canvas', { width: picture.width, height: picture.height });
    canvas.getContext('2d').drawImage(picture, 0, 0);
    canvas.style.left = i * strip.clientWidth / places + 'px';
    canvas.style.width = strip.clientWidth / places + 'px';
    nodes.push(canvas);
  }
  strip.replaceChildren(...nodes);
}

// --- time

// One request at a time: the next is sent when its step has come, and only the newest wish counts.
function request(index) {
  if (page.mode === 'live') return;
  index = Math.max(0, Math.min(page.steps - 1, index));
  if (recorded) index = recorded.at(index);
  page.wanted = index;
  if (page.waitingFor !== null) return;
  page.waitingFor = index;
  say({ op: 'show', index, camera: page.camera });
}
const lastStep = () => recorded ? recorded.at(page.steps - 1) : page.steps - 1;
function seek(index) {
  if (page.mode === 'live') return;
  setPlaying(false);
  request(index);
}
function setPlaying(playing) {
  page.playing = playing;
  $('play').textContent = playing ? 'Pause' : page.mode === 'live' ? 'Resume' : 'Play';
  if (!playing || page.mode === 'live') return;
  if (page.step && page.step.index >= lastStep()) request(0);
  let last = performance.now(), time = page.step ? page.step.time : 0;
  const tick = (now) => {
    if (!page.playing || page.mode === 'live') return;
    time += (now - last) / 1000 * Number($('speed').value);
    last = now;
    if (page.waitingFor === null && page.step) {
      const at = page.step.index;
      if (at >= lastStep() && page.done) return setPlaying(false);
      // The history says when each step was, so that speed is true to the recording.
      let next = trends.indexAt(time);
      if (next < at && time > page.step.time) next = at;
      if (recorded) next = recorded.at(next);
      if (next !== at) request(next);
      if (Math.abs(page.step.time - time) > 1 && !recorded) time = page.step.time;
    }
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}
const toChange = (direction) => {
  if (!page.step || page.mode === 'live') return;
  const from = page.wanted ?? page.step.index;
  let event = bands.neighbour(from, direction);
  // In a file, the step of a change may be left out: the one that stands for it is not beyond where we are.
  while (recorded && event && direction > 0 && recorded.at(event.index) <= from) event = bands.neighbour(event.index, direction);
  if (event) { select(bands.objects[event.object]); seek(event.index); }
};
const move = (steps) => { if (page.step && page.mode !== 'live') seek(recorded ? recorded.at(page.step.index, steps) : page.step.index + steps); };

// --- questions

function addAnswer(text, when) {
  const number = nextNumber++;
  const element = make('div', { className: 'answer' }, make('h3', {}, make('span', { textContent: text }), make('small', { textContent: when })), make('p', { textContent: 'is being worked out ...' }));
  $('answers').prepend(element);
  while (!recorded && $('answers').children.length > 20) $('answers').lastChild.remove();  // a file has no more than it has
  asked.set(number, { element, answer: null });
  element.addEventListener('click', () => showInScene(number));
  return number;
}
function ask(text, question) {
  if (recorded) return;
  const step = page.step, number = addAnswer(text, step ? step.time.toFixed(2) + ' s' : '');
  const request = { op: 'ask', number, question };
  if (step && page.mode === 'recording') request.index = step.index;
  say(request);
}
function fillAnswer(number, answer) {
  const of = asked.get(number);
  of.answer = answer;
  while (of.element.children.length > 1) of.element.lastChild.remove();
  of.element.firstElementChild.append(copyButton('JSON', 'Copy the answer', () => JSON.stringify(answer, null, 2)));
  try { of.element.append(...answerContent(answer)); } catch (error) { of.element.append(make('p', { className: 'bad', textContent: 'The answer has another form than expected: ' + error.message })); }
}
function showAnswer(number, answer) {
  const of = asked.get(number);
  if (!of) return;
  fillAnswer(number, answer);
  if (answer.step !== undefined && page.step && answer.step !== page.step.step && page.mode === 'recording')
    of.element.append(make('p', { textContent: 'Of the belief at step ' + answer.step }));
  if (answer.predict) showInScene(number);
}
function showInScene(number) {
  const of = asked.get(number), already = page.shownAnswer === of.answer;
  for (const { element } of asked.values()) element.classList.remove('shown');
  page.shownAnswer = already ? null : of.answer;
  of.element.classList.toggle('shown', !already && !!of.answer);
  redraw();
}
const questions = {
  where: () => ask(page.selected ? 'Where is ' + page.selected + '?' : 'Where is everything?', { where: page.selected ? { object: page.selected } : {} }),
  stays: () => page.selected && ask('Does ' + page.selected + ' stay?', { stability: { object: page.selected } }),
  release: () => page.selected && ask('What if ' + page.selected + ' is let go?', { predict: { actions: [{ time: 0, release: { object: page.selected } }] } }),
};

// --- buttons and keys

function toggle(name) {
  page[name] = !page[name];
  $(name).setAttribute('aria-pressed', page[name]);
  redraw();
}
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  redraw();
}
const remembered = (() => { try { return localStorage.getItem('theme'); } catch { return null; } })();
setTheme(remembered ?? (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'));
function swapTheme() {
  setTheme(dark() ? 'light' : 'dark');
  try { localStorage.setItem('theme', document.documentElement.dataset.theme); } catch { /* a browser that keeps nothing */ }
}
const whole = () => { if (page.step) { space.frame(page.step); redraw(); } };
const fromCamera = () => { if (page.step) { space.fromCamera(page.step); redraw(); } };

$('ghosts').onclick = () => toggle('ghosts');
$('overlay').onclick = () => toggle('overlay');
$('frame').onclick = whole;
$('theme').onclick = swapTheme;
$('help').onclick = () => $('keys').showModal();
$('which').onchange = () => setCamera(Number($('which').value));
$('play').onclick = () => setPlaying(!page.playing);
$('back').onclick = () => move(-1);
$('on').onclick = () => move(1);
$('scrub').oninput = () => seek(Number($('scrub').value));
$('ask-where').onclick = questions.where;
$('ask-stays').onclick = questions.stays;
$('ask-release').onclick = questions.release;
$('ask-own').onclick = () => {
  let question;
  try { question = JSON.parse($('ask-text').value); } catch (error) { question = null; }
  if (question && typeof question === 'object' && !Array.isArray(question)) ask(Object.keys(question).join(', '), question);
  else $('answers').prepend(make('div', { className: 'answer' }, make('p', { className: 'bad', textContent: 'A question is a JSON object, as {"where": {}}' })));
};
$('space').addEventListener('turned', redraw);
new ResizeObserver(() => { redraw(); drawStrip(); }).observe(document.querySelector('main'));

const keys = {
  ' ': () => setPlaying(!page.playing), ArrowLeft: (e) => move(e.shiftKey ? -10 : -1), ArrowRight: (e) => move(e.shiftKey ? 10 : 1),
  Home: () => seek(0), End: () => seek(page.steps - 1), g: () => toggle('ghosts'), o: () => toggle('overlay'), f: whole, c: fromCamera,
  v: () => { if (page.cameras.length > 1) setCamera((page.camera + 1) % page.cameras.length); },
  n: () => toChange(1), p: () => toChange(-1), t: swapTheme, w: questions.where, s: questions.stays, r: questions.release, '?': () => $('keys').showModal(),
};
addEventListener('keydown', (e) => {
  if (e.ctrlKey || e.altKey || e.metaKey || e.target.closest('textarea, select, dialog')) return;
  if (e.target.closest('button, summary') && (e.key === ' ' || e.key === 'Enter')) return;
  if (e.target.closest('input') && (e.key.startsWith('Arrow') || e.key === 'Home' || e.key === 'End')) return;
  const digit = Number(e.key);
  if (digit >= 1 && page.step && page.step.objects[digit - 1]) return select(page.step.objects[digit - 1].name);
  const act = keys[e.key.length === 1 ? e.key.toLowerCase() : e.key];
  if (!act) return;
  e.preventDefault();
  act(e);
});

// The token stays out of the history and of what is read over one's shoulder: the cookie has it.
if (new URLSearchParams(location.search).has('token')) history.replaceState(null, '', location.pathname);
connect();
