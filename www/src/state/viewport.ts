/**
 * Zooming and panning. A view maps a point p of the picture to (p − centre) · zoom + ½ in the viewport box; both
 * are in units of the box, 0 to 1. A view never shows anything beyond the picture.
 */

import { CENTRE, clampAndRound, type PicturePoint } from '../shared/value-types.js';

/** The part of the picture that is shown. */
export interface ZoomView {
  /** Magnification; 1 shows the whole picture. */
  readonly zoom: number;
  /** The point of the picture at the centre: (0, 0) is the top left corner, (1, 1) the bottom right corner. */
  readonly x: number;
  readonly y: number;
}

/** Fields of another view. */
export interface ViewChange extends Partial<ZoomView> {
  /** In place of `zoom`: pixels of the screen along the side of a pixel of the picture. */
  readonly scale?: number;
}

/** A part of the picture: its top left corner and its size, as fractions of the picture. */
export interface PictureRect {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** Where the viewport is on the page. */
export type Box = Pick<DOMRectReadOnly, 'left' | 'top' | 'width' | 'height'>;

export const FULL_VIEW: ZoomView = { zoom: 1, ...CENTRE };
const DOUBLE_TAP_ZOOM = 2.5;
/** From here on, views are of very large pictures. */
const FINE_ZOOM = 8;
export const ZOOM_STEP = 1.5;
const WHEEL_PIXELS_PER_DOUBLING = 240;
/** A coarse wheel turns in large steps; limit one event. */
const MAX_WHEEL_PIXELS = 120;
/** The height of a line, for wheels that count lines. */
const WHEEL_LINE_PIXELS = 40;

/** The view that shows a part of the picture, as large as possible. */
export function viewOf({ x = 0, y = 0, width, height = width }: PictureRect): ZoomView {
  return { zoom: 1 / Math.max(width, height), x: x + width / 2, y: y + height / 2 };
}

/** The nearest view inside the picture, with a magnification of at most `maxZoom`. */
export function clampView({ zoom, x, y }: ZoomView, maxZoom: number): ZoomView {
  const edge = 0.5 / Math.min(maxZoom, Math.max(1, zoom));
  // Four decimals may be more than a pixel of the screen.
  const steps = zoom > FINE_ZOOM ? 1e6 : 1e4;
  const clampCentre = (value: number) => clampAndRound(value, edge, 1 - edge, steps);
  return { zoom: clampAndRound(zoom, 1, maxZoom), x: clampCentre(x), y: clampCentre(y) };
}

export function toPicture(view: ZoomView, { x, y }: PicturePoint): PicturePoint {
  return { x: view.x + (x - 0.5) / view.zoom, y: view.y + (y - 0.5) / view.zoom };
}

/** From picture to viewport coordinates; outside of 0 to 1 the point is not visible. */
export function toViewport(view: ZoomView, { x, y }: PicturePoint): PicturePoint {
  return { x: (x - view.x) * view.zoom + 0.5, y: (y - view.y) * view.zoom + 0.5 };
}

/** The point of the picture at a position on the page; `null` outside of the box that shows the picture. */
export function pointAt(view: ZoomView, box: Box, { x, y }: PicturePoint): PicturePoint | null {
  const shown = { x: (x - box.left) / box.width, y: (y - box.top) / box.height };
  const isInside = [shown.x, shown.y].every((coordinate) => coordinate >= 0 && coordinate <= 1);
  return isInside ? toPicture(view, shown) : null;
}

/** The position on the page of a point of the picture, also where the view does not show it. */
export function positionOf(view: ZoomView, box: Box, point: PicturePoint): PicturePoint {
  const { x, y } = toViewport(view, point);
  return { x: box.left + x * box.width, y: box.top + y * box.height };
}

/** Magnifies by `factor`. The picture stays fixed at the viewport point `at`; the centre may lie beyond the edges. */
export function zoomAt(view: ZoomView, factor: number, at: PicturePoint, maxZoom: number) {
  const fixed = toPicture(view, at);
  const zoom = Math.min(maxZoom, Math.max(1, view.zoom * factor));
  const x = fixed.x - (at.x - 0.5) / zoom;
  const y = fixed.y - (at.y - 0.5) / zoom;
  return { zoom, x, y };
}

/** Moves the picture by (dx, dy) in viewport coordinates, perhaps beyond its edges. */
export function pan({ zoom, x, y }: ZoomView, dx: number, dy: number): ZoomView {
  return { zoom, x: x - dx / zoom, y: y - dy / zoom };
}

/** Zooms in at a viewport point, or back out to the whole picture. */
export function toggleZoom(view: ZoomView, at: PicturePoint, maxZoom: number): ZoomView {
  return view.zoom > 1 ? FULL_VIEW : zoomAt(view, DOUBLE_TAP_ZOOM, at, maxZoom);
}

/** The magnification of a wheel event, from its `deltaY` and `deltaMode`. */
export function wheelFactor(delta: number, mode: number): number {
  const unit = [1, WHEEL_LINE_PIXELS, MAX_WHEEL_PIXELS][mode] ?? 1;
  const pixels = Math.max(-MAX_WHEEL_PIXELS, Math.min(MAX_WHEEL_PIXELS, unit * delta));
  return 2 ** (-pixels / WHEEL_PIXELS_PER_DOUBLING);
}
