// SPDX-License-Identifier: Apache-2.0
// The live view of a recording and its report in a browser: what they show is what the program says.
//   node page_test.mjs <the program> <a scene file>
// Exit code 77 where there is no browser; with PRESCENE_NO_SKIP=1 that is a failure.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { pathToFileURL } from 'node:url';
import { Browser, findChromium } from './browser.mjs';
import { checkChanges, checkObjects, checkScrubbing, checkTheme, pageAt } from './checks.mjs';

const [program, scene] = process.argv.slice(2), chromium = findChromium();
if (!chromium) {
  console.log('skipped: there is no Chromium (Debian: chromium)');
  process.exit(process.env.PRESCENE_NO_SKIP === '1' ? 1 : 77);
}
const folder = mkdtempSync(join(tmpdir(), 'prescene_page_test_')), recording = join(folder, 'run.mcap'), report = join(folder, 'report.html');
function run(...args) {
  const { status, stdout, stderr } = spawnSync(program, args, { encoding: 'utf8', maxBuffer: 1 << 28 });
  assert.equal(status, 0, args.join(' ') + '\n' + stderr);
  return stdout;
}
run('record', '--simulate', scene, '-o', recording, '--seed', '3');
const replayed = JSON.parse(run('replay', recording, '--report', report, '--json'));
const browser = new Browser(chromium);
let view;
try {
  // --- the live view
  view = spawn(program, ['view', recording, '--port', '0', '--json'], { stdio: ['ignore', 'pipe', 'ignore'] });
  const { url } = await new Promise((done) => view.stdout.once('data', (text) => done(JSON.parse(text))));
  await browser.open(url);
  // A second connection reads along what the page is given.
  await browser.until(`typeof document.querySelector('#clock')?.textContent === 'string' && document.querySelector('#state').textContent === 'recording' && document.querySelector('#clock').textContent !== '-'`);
  await browser.value(`new Promise((done) => {
    window.given = { steps: new Map(), wanted: null };
    const socket = window.given.socket = new WebSocket('ws://' + location.host + '/', 'prescene.view.v1');
    socket.onmessage = ({ data }) => {
      if (typeof data !== 'string') return;
      const message = JSON.parse(data);
      window.given[message.op] = message;
      if (message.op === 'step' && window.given.wanted) window.given.wanted(message);
      if (message.op === 'extent') done();
    };
  })`);
  const { history, extent } = await browser.value('({ history: given.history, extent: given.extent })');
  const liveStep = (index) => browser.value(`new Promise((done) => { given.wanted = done; given.socket.send(JSON.stringify({ op: 'show', index: ${index}, camera: 0 })); })`);
  const live = pageAt(browser, 'document');
  assert.equal(extent.steps, replayed.steps.length);
  await live.press('Home');
  await checkObjects(live, await liveStep(0));
  await checkChanges(live, history, liveStep);
  await checkScrubbing(live, history, extent.steps, liveStep);
  await checkTheme(live);
  // Every step of the replay has the state that the bands have.
  replayed.steps.forEach(({ objects }, index) => objects.forEach(({ name, state }) => {
    const run = history.runs.findLast(([object, from]) => history.objects[object] === name && from <= index);
    assert.equal(run[3], state, name + ' at step ' + index);
  }));
  await live.press('End');
  const last = await liveStep(extent.steps - 1);
  await checkObjects(live, last);
  for (const object of last.objects) {
    await browser.value(`[...document.querySelectorAll('.object')].find((row) => row.querySelector('.name').textContent === ${JSON.stringify(object.name)}).click()`);
    await live.until(`$at.querySelector('.object[aria-selected="true"] .name').textContent === ${JSON.stringify(object.name)}`);
    await live.click('#ask-where');
    await live.until(`!$at.querySelector('.answer p').textContent.startsWith('is being')`);
    const said = await live.text('.answer p');
    assert.ok(said.startsWith(object.name + ': ' + object.state + ', '), said);
  }
  assert.deepEqual(browser.problems, []);

  // --- the report
  browser.requests.length = 0;
  await browser.open(pathToFileURL(report).href);
  const frame = `document.querySelector('iframe.page').contentDocument`;
  await browser.until(`!!document.querySelector('iframe.page') && ${frame}?.querySelector('#clock')?.textContent.includes('step')`);
  const embedded = JSON.parse(await browser.value(`${frame}.querySelector('#recorded').textContent`));
  const kept = (index) => embedded.steps.findLast((step) => step.index <= index) ?? embedded.steps[0];
  const offline = pageAt(browser, frame);
  assert.deepEqual(embedded.history.runs, history.runs);
  assert.equal(embedded.count, extent.steps);
  for (const step of embedded.steps) {
    const { objects } = replayed.steps[step.index];
    assert.deepEqual(step.objects.map((o) => [o.name, o.state]), objects.map((o) => [o.name, o.state]));
  }
  await offline.press('Home');
  await checkObjects(offline, kept(0));
  await checkChanges(offline, embedded.history, kept);
  await checkScrubbing(offline, embedded.history, embedded.count, kept);
  await checkTheme(offline);
  assert.ok(await browser.value(`${frame}.querySelector('#ask-where').disabled`));
  assert.deepEqual(browser.requests.filter((address) => !/^(file|data|blob|about):/.test(address)), [], 'a report loads nothing');
  assert.deepEqual(browser.problems, []);
  assert.ok(readFileSync(report).length < 64 << 20);
} finally {
  if (view) view.kill('SIGINT');
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
