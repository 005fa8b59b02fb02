// SPDX-License-Identifier: Apache-2.0
// Stands for the program where the page is in a file: what the program would send is in the file.

const headerBytes = 16, mostStrips = 40;

function pictureMessage(kind, { index, camera, jpeg }) {
  const bytes = atob(jpeg), data = new Uint8Array(headerBytes + bytes.length), view = new DataView(data.buffer);
  data[0] = kind;
  data[1] = camera;
  view.setBigUint64(8, BigInt(index), true);
  for (let i = 0; i < bytes.length; ++i) data[headerBytes + i] = bytes.charCodeAt(i);
  return data.buffer;
}
// The last of a list, ascending by `index`, that is not beyond the index; the first where all are.
function lastUntil(list, index) {
  let low = 0, high = list.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (list[middle].index <= index) low = middle; else high = middle - 1;
  }
  return low;
}

export class RecordedProgram {
  // `receive` takes documents, `receivePicture` what the program sends as binary messages.
  constructor(data, receive, receivePicture) {
    Object.assign(this, { data, receive, receivePicture });
    this.pictures = new Map();
    for (const picture of data.pictures) {
      if (!this.pictures.has(picture.camera)) this.pictures.set(picture.camera, []);
      this.pictures.get(picture.camera).push(picture);
    }
  }
  open() {
    const { data } = this;
    this.receive({ op: 'hello', mode: 'recording', title: data.title });
    this.receive(data.scene);
    this.receive(data.history);
    const every = Math.max(1, Math.ceil(data.pictures.length / mostStrips));
    data.pictures.filter((_, i) => i % every === 0).forEach((picture) => this.receivePicture(pictureMessage(2, picture)));
    this.receive({ op: 'extent', steps: data.count, done: true, progress: 1, remarks: data.remarks });
  }
  // Which of the kept steps stands for a step, and which is so many kept ones away.
  at(index, away = 0) {
    const { steps } = this.data;
    return steps.length ? steps[Math.max(0, Math.min(steps.length - 1, lastUntil(steps, index) + away))].index : 0;
  }
  show(index, camera) {
    const { steps } = this.data, own = this.pictures.get(camera) ?? [];
    if (!steps.length) return;
    const step = steps[lastUntil(steps, index)], picture = own.length ? own[lastUntil(own, step.index)] : null;
    if (picture) this.receivePicture(pictureMessage(1, picture));
    // Of several cameras, which take turns, the newest picture is a few steps old. Another one is not of this step: the
    // picture at it was left out.
    const age = picture ? step.index - picture.index : 0;
    this.receive(age >= 0 && age < Math.max(1, this.pictures.size) ? step : { ...step, pictureAge: age });
  }
}
