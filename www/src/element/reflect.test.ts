import assert from 'node:assert/strict';
import test from 'node:test';
import { AttributeReader } from '../state/attribute-reader.js';
import { type ElementOptions, readOptions } from '../state/options.js';
import { ATTRIBUTES, PROPERTIES, type ReflectedProperties, reflect } from './reflect.js';

/** The part of an element that the properties use. */
class FakeElement {
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
reflect(FakeElement.prototype);

function createElement(): FakeElement & ReflectedProperties {
  return new FakeElement() as FakeElement & ReflectedProperties;
}

test('properties have defaults', () => {
  const element = createElement();
  assert.deepEqual(Object.fromEntries(PROPERTIES.map((name) => [name, element[name]])), {
    src: '',
    alt: '',
    width: 0,
    height: 0,
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
    loading: 'eager',
    reveal: 'auto',
    controls: false,
    zoom: 1,
    cooperativeGestures: false,
    minimap: false,
    autoplayLight: false,
    kiosk: 0,
    crossOrigin: null,
  });
  assert.equal(ATTRIBUTES.length, PROPERTIES.length + 1, 'and light');
});

test('properties write their attributes', () => {
  const element = createElement();
  Object.assign(element, { lightX: 0.25, controls: true, zoom: 4, crossOrigin: 'use-credentials' });
  assert.deepEqual(Object.fromEntries(element.attributes), {
    'light-x': '0.25',
    controls: '',
    zoom: '4',
    crossorigin: 'use-credentials',
  });
  assert.deepEqual([element.lightX, element.controls, element.zoom], [0.25, true, 4]);
  Object.assign(element, { controls: false, crossOrigin: null });
  assert.deepEqual([...element.attributes.keys()], ['light-x', 'zoom']);
  element.setAttribute('zoom', '');
  element.setAttribute('kiosk', '');
  assert.deepEqual([element.zoom, element.kiosk], [8, 60]);
  element.setAttribute('zoom', 'much');
  element.setAttribute('loading', 'later');
  assert.deepEqual([element.zoom, element.loading], [1, 'eager']);
});

test('all options are read together, and errors name their attribute', (t) => {
  // The element parses CSS colours by painting a pixel.
  const getImageData = () => ({ data: [255, 0, 0, 255] });
  const context = { fillStyle: '', clearRect: () => {}, fillRect: () => {}, getImageData };
  const createCanvas = () => ({ getContext: () => context });
  Object.assign(globalThis, { document: { createElement: createCanvas } });
  t.after(() => Reflect.deleteProperty(globalThis, 'document'));
  const element = createElement();
  const reader = new AttributeReader(element);
  let options: ElementOptions | null = null;
  const read = () => {
    options = readOptions(reader, options);
    return options;
  };
  element.setAttribute('src', 'window.ltm');
  element.setAttribute('light-x', '0.25');
  element.setAttribute('light-color', 'red');
  element.setAttribute('crossorigin', '');
  element.setAttribute('cooperative-gestures', '');
  const { src, light, crossOrigin, cooperativeGestures, autoplayLight } = read();
  assert.equal(src, 'https://a.org/page/window.ltm');
  assert.deepEqual(light.torch, { x: 0.25, y: 0.5 });
  assert.deepEqual(light.color?.factors, [1, 0, 0]);
  assert.deepEqual([crossOrigin, cooperativeGestures, autoplayLight], ['anonymous', true, false]);
  assert.equal(read(), options, 'the same object without a change');
  element.setAttribute('zoom', '3');
  assert.equal(read().light, light, 'the same light after a change of the zoom');
  element.setAttribute('light-x', 'left');
  element.setAttribute('poster', 'http://[');
  assert.deepEqual(read().light.torch, { x: 0.25, y: 0.5 }, 'the last valid value');
  const messages = reader.takeErrors().map(({ message }) => message);
  assert.match(messages.join(' '), /light-x “left”.*“http:\/\/\[” in poster/);
});
