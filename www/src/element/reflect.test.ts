import assert from 'node:assert/strict';
import test from 'node:test';
import { Attributes } from '../state/attribute-reader.js';
import { readAsked } from '../state/options.js';
import { ATTRIBUTES, PROPERTIES, type Reflected, reflect } from './reflect.js';

/** What of an element properties need. */
class Holder {
  readonly baseURI = 'https://a.org/page/';
  readonly attributes = new Map<string, string>();
  getAttribute(name: string): string | null {
    return this.attributes.get(name) ?? null;
  }
  setAttribute(name: string, value: string): void {
    this.attributes.set(name, value);
  }
  removeAttribute(name: string): void {
    this.attributes.delete(name);
  }
}
reflect(Holder.prototype);

function holder(): Holder & Reflected {
  return new Holder() as Holder & Reflected;
}

test('properties say what goes without saying', () => {
  const it = holder();
  assert.deepEqual(Object.fromEntries(PROPERTIES.map((name) => [name, it[name]])), {
    src: '',
    alt: '',
    light: 'flood',
    lightSrc: '',
    lightColor: 'white',
    lightSize: 1 / 7,
    lightX: 0.5,
    lightY: 0.5,
    exposure: 1,
    whiteBalance: '1 1 1',
    tone: 'clip',
    gamut: 'srgb',
    backend: 'webgpu webgl2 cpu',
    poster: '',
    loading: 'auto',
    reveal: 'auto',
    controls: false,
    zoom: 1,
    cooperativeGestures: false,
    autoplayLight: false,
    kiosk: 0,
    wasmUrl: '',
    crossOrigin: null,
  });
  assert.equal(ATTRIBUTES.length, PROPERTIES.length);
});

test('properties are attributes', () => {
  const it = holder();
  Object.assign(it, { lightX: 0.25, controls: true, zoom: 4, crossOrigin: 'use-credentials' });
  assert.deepEqual(Object.fromEntries(it.attributes), {
    'light-x': '0.25',
    controls: '',
    zoom: '4',
    crossorigin: 'use-credentials',
  });
  assert.deepEqual([it.lightX, it.controls, it.zoom], [0.25, true, 4]);
  Object.assign(it, { controls: false, crossOrigin: null });
  assert.deepEqual([...it.attributes.keys()], ['light-x', 'zoom']);
  it.setAttribute('zoom', '');
  it.setAttribute('kiosk', '');
  assert.deepEqual([it.zoom, it.kiosk], [8, 60]);
  it.setAttribute('zoom', 'much');
  it.setAttribute('loading', 'later');
  assert.deepEqual([it.zoom, it.loading], [1, 'auto']);
});

test('attributes are read together, and what is wrong is told with its name', () => {
  const it = holder();
  const attributes = new Attributes();
  const asked = () => readAsked(it, attributes, () => [255, 0, 0, 255]);
  it.setAttribute('src', 'window.ltm');
  it.setAttribute('light-x', '0.25');
  it.setAttribute('light-color', 'red');
  it.setAttribute('wasm-url', '../wasm');
  it.setAttribute('crossorigin', '');
  it.setAttribute('cooperative-gestures', '');
  const { src, light, wasm, crossOrigin, cooperative, breathes } = asked();
  assert.equal(src, 'https://a.org/page/window.ltm');
  assert.deepEqual(light.place, { x: 0.25, y: 0.5 });
  assert.deepEqual(light.color?.factors, [1, 0, 0]);
  assert.equal(wasm, 'https://a.org/wasm/');
  assert.deepEqual([crossOrigin, cooperative, breathes], ['anonymous', true, false]);
  it.setAttribute('light-x', 'left');
  it.setAttribute('poster', 'http://[');
  assert.deepEqual(asked().light.place, { x: 0.25, y: 0.5 }, 'as it was when it was right');
  const told = attributes.takeFaults().map(({ message }) => message);
  assert.match(told.join(' '), /light-x “left”.*“http:\/\/\[” in poster/);
});
