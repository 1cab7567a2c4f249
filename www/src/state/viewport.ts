/** Which part of a picture is seen: zooming and panning, never past its edges. */

import type { PicturePoint } from '../shared/values.js';

/** What part of the picture is shown. */
export interface PhotoView {
  /** Magnification; 1 shows all of the picture. */
  readonly zoom: number;
  /** The point of the picture in the middle: 0, 0 is the top left corner and 1, 1 the bottom right. */
  readonly x: number;
  readonly y: number;
}

/** All of the picture. */
export const WHOLE: PhotoView = { zoom: 1, x: 0.5, y: 0.5 };
/** What a double tap magnifies to. */
export const CLOSER = 2.5;
/** What a key or a button magnifies by. */
export const ZOOM_STEP = 1.5;
/** Pixels of the wheel in which a picture doubles. */
const WHEEL_DOUBLES = 240;
/** A turn of a coarse wheel is not a leap. */
const MOST_WHEEL = 120;

/** The nearest view that shows nothing but the picture, magnified by no more than `most`. */
export function clampView({ zoom, x, y }: PhotoView, most: number): PhotoView {
  const fit = Math.min(most, Math.max(1, zoom));
  const edge = 0.5 / fit;
  const within = (value: number) => rounded(Math.min(1 - edge, Math.max(edge, value)));
  return { zoom: rounded(fit), x: within(x), y: within(y) };
}

/** The point of the picture that is seen at one of the box, both from 0 to 1. */
export function toPicture(view: PhotoView, { x, y }: PicturePoint): PicturePoint {
  return { x: view.x + (x - 0.5) / view.zoom, y: view.y + (y - 0.5) / view.zoom };
}

/** Where in the box a point of the picture is seen; outside of 0 to 1 it is not. */
export function toBox(view: PhotoView, { x, y }: PicturePoint): PicturePoint {
  return { x: (x - view.x) * view.zoom + 0.5, y: (y - view.y) * view.zoom + 0.5 };
}

/** Magnifies by a factor; what is seen at that point of the box stays there, as far as edges let it. */
export function zoomAt(view: PhotoView, factor: number, at: PicturePoint, most: number): PhotoView {
  const held = toPicture(view, at);
  const zoom = Math.min(most, Math.max(1, view.zoom * factor));
  const x = held.x - (at.x - 0.5) / zoom;
  const y = held.y - (at.y - 0.5) / zoom;
  return clampView({ zoom, x, y }, most);
}

/** Takes the picture along by so much of the box. */
export function pan(view: PhotoView, dx: number, dy: number, most: number): PhotoView {
  const { zoom } = view;
  return clampView({ zoom, x: view.x - dx / zoom, y: view.y - dy / zoom }, most);
}

/** Closer at that point of the box, or all of the picture again. */
export function toggleZoom(view: PhotoView, at: PicturePoint, most: number): PhotoView {
  return view.zoom > 1 ? WHOLE : zoomAt(view, CLOSER, at, most);
}

/** What a turn of the wheel magnifies by. Lines are as high as browsers take them to be. */
export function wheelFactor(delta: number, mode: number): number {
  const pixels = mode === 1 ? 40 * delta : mode === 2 ? MOST_WHEEL * delta : delta;
  return 2 ** (-Math.max(-MOST_WHEEL, Math.min(MOST_WHEEL, pixels)) / WHEEL_DOUBLES);
}

export function sameView(a: PhotoView, b: PhotoView): boolean {
  return a.zoom === b.zoom && a.x === b.x && a.y === b.y;
}

/** As short in words as it has to be, and far finer than can be seen. */
function rounded(value: number): number {
  return Math.round(value * 1e4) / 1e4;
}
