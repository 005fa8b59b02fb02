// SPDX-License-Identifier: Apache-2.0
// Chromium without a window, told what to do through a pipe [https://chromedevtools.github.io/devtools-protocol]. Needs
// nothing but node.
import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

export function findChromium() {
  return ['chromium', 'chromium-browser', 'google-chrome'].find((name) => spawnSync(name, ['--version']).status === 0);
}

export class Browser {
  constructor(program) {
    this.folder = mkdtempSync(join(tmpdir(), 'prescene_page_'));
    this.child = spawn(program, ['--headless=new', '--no-sandbox', '--remote-debugging-pipe', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--disable-dev-shm-usage', '--disable-background-networking', '--no-first-run', '--user-data-dir=' + this.folder, '--window-size=1500,1100'],
    { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.next = 1;
    this.waiting = new Map();
    this.problems = [];  // what a console would show as an error
    this.requests = [];  // addresses that were asked for
    let rest = '';
    this.child.stdio[4].setEncoding('utf8').on('data', (text) => {
      rest += text;
      for (let end; (end = rest.indexOf('\0')) >= 0; rest = rest.slice(end + 1)) this.take(JSON.parse(rest.slice(0, end)));
    });
    this.child.on('exit', () => { for (const { reject } of this.waiting.values()) reject(new Error('the browser ended')); });
  }
  take({ id, result, error, method, params }) {
    if (id) {
      const { resolve, reject } = this.waiting.get(id);
      this.waiting.delete(id);
      return error ? reject(new Error(error.message)) : resolve(result);
    }
    if (method === 'Runtime.exceptionThrown') this.problems.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && params.type === 'error') this.problems.push(params.args.map((a) => a.value ?? a.description).join(' '));
    if (method === 'Log.entryAdded' && params.entry.level === 'error') this.problems.push(params.entry.text);
    if (method === 'Network.requestWillBeSent') this.requests.push(params.request.url);
  }
  call(method, params = {}) {
    const id = this.next++;
    this.child.stdio[3].write(JSON.stringify({ id, method, params, sessionId: this.session }) + '\0');
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }
  async open(url) {
    this.session = undefined;
    const { targetId } = await this.call('Target.createTarget', { url: 'about:blank' });
    this.session = (await this.call('Target.attachToTarget', { targetId, flatten: true })).sessionId;
    for (const domain of ['Runtime', 'Log', 'Network', 'Page']) await this.call(domain + '.enable');
    await this.call('Page.navigate', { url });
  }
  // The value of an expression in the page; a promise is waited for.
  async value(expression) {
    const { result, exceptionDetails } = await this.call('Runtime.evaluate', { expression, returnByValue: true, awaitPromise: true });
    if (exceptionDetails) throw new Error(expression + ': ' + (exceptionDetails.exception?.description ?? exceptionDetails.text));
    return result.value;
  }
  // As soon as the expression is true; what ends a wait that never ends is the limit of the test.
  async until(expression) {
    while (!await this.value(expression)) await this.value('new Promise((done) => setTimeout(done, 20))');
  }
  close() {
    return new Promise((done) => {
      this.child.once('exit', () => { rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 }); done(); });
      this.child.kill();
    });
  }
}
