// SPDX-License-Identifier: Apache-2.0
// What the page shows against the documents that it was given. `at` is an expression of the page's document: that of
// the live view, or that of the frame in a report.
import assert from 'node:assert/strict';

export function pageAt(browser, at) {
  const text = (selector) => browser.value(`${at}.querySelector(${JSON.stringify(selector)})?.textContent`);
  const texts = (selector) => browser.value(`[...${at}.querySelectorAll(${JSON.stringify(selector)})].map((e) => e.textContent)`);
  const click = (selector) => browser.value(`${at}.querySelector(${JSON.stringify(selector)}).click()`);
  const press = (key) => browser.value(`${at}.body.dispatchEvent(new (${at}.defaultView.KeyboardEvent)('keydown', { key: ${JSON.stringify(key)}, bubbles: true }))`);
  const until = (expression) => browser.until(expression.replaceAll('$at', at));
  const shows = (step) => until(`$at.querySelector('#clock').textContent.endsWith(', step ${step}')`);
  return { browser, at, text, texts, click, press, until, shows };
}

// The objects' panel says what the step's document says.
export async function checkObjects(page, step) {
  await page.shows(step.step);
  assert.deepEqual(await page.texts('.object .name'), step.objects.map((o) => o.name));
  assert.deepEqual(await page.texts('.object .badge'), step.objects.map((o) => o.state));
  const percent = (p) => (100 * p).toFixed(p > 0 && p < 0.01 ? 1 : 0) + ' %';
  const shown = await page.texts('.object .facts dd:first-of-type');
  assert.deepEqual(shown, step.objects.map((o) => percent(o.confidence)));
}

// Each change of a state is in the list, a click goes to its step, and N and P go from one to the next.
export async function checkChanges(page, history, stepAt) {
  const changes = [], newest = new Map();
  for (const [object, index, time, state, heldBy] of history.runs) {
    const before = newest.get(object);
    newest.set(object, { state, heldBy });
    if (!before) continue;
    const said = [];
    if (before.state !== state) said.push(before.state + ', then ' + state);
    if (before.heldBy !== heldBy) said.push(heldBy ? 'held by ' + heldBy : 'let go by ' + before.heldBy);
    changes.push({ index, text: `${time.toFixed(2)} s, ${history.objects[object]}: ${said.join('; ')}` });
  }
  assert.deepEqual(await page.texts('#events button'), changes.map((c) => c.text));
  assert.match((await page.texts('#happened p')).join(' '), /tracked.*doubtful.*unseen.*lost.*held/, 'what the colours mean');
  for (const { index } of changes.slice(0, 5)) {
    await page.browser.value(`[...${page.at}.querySelectorAll('#events button')][${changes.findIndex((c) => c.index === index)}].click()`);
    await checkObjects(page, await stepAt(index));
  }
  if (!changes.length) return;
  await page.press('Home');
  await page.shows((await stepAt(0)).step);
  await page.press('n');
  const first = Math.min(...changes.map((c) => c.index).filter((index) => index > 0));
  await page.shows((await stepAt(first)).step);
}

// A press on the bands goes to the step beneath it.
export async function checkScrubbing(page, history, count, stepAt) {
  const canvas = `${page.at}.querySelector('#bands canvas')`;
  for (const share of [0.31, 0.77]) {
    const index = Math.round(share * (count - 1));
    if (history.runs.some(([, at]) => Math.abs(at - index) < 12)) continue;  // there a press goes to the change
    await page.browser.value(`(() => { const c = ${canvas}, box = c.getBoundingClientRect(), x = box.left + 8 + ${index / (count - 1)} * (c.clientWidth - 16);
      c.setPointerCapture = () => {};
      c.dispatchEvent(new (${page.at}.defaultView.PointerEvent)('pointerdown', { clientX: x, clientY: box.top + 4, buttons: 1, bubbles: true })); })()`);
    await checkObjects(page, await stepAt(index));
  }
}

export async function checkTheme(page) {
  const theme = () => page.browser.value(`${page.at}.documentElement.dataset.theme`);
  const before = await theme();
  await page.press('t');
  assert.notEqual(await theme(), before);
  await page.press('t');
  assert.equal(await theme(), before);
}
