/** A source of light that tells what becomes of it, for as long as anyone looks. */

import { messageOf, PhotoError } from '../shared/errors.js';
import { Projected } from './image-light.js';
import { isA, type LightPicture, type LightSource } from './light-source.js';
import type { Projection } from './projection.js';

/** What is told of a source. */
export interface SourceListener {
  /** It shows something else. */
  changed(): void;
  /** It cannot be had, or can again. */
  faultChanged(fault: PhotoError | null): void;
}

/** See the module. Holds on to nothing before `start` and after `stop`. */
export class LightFollower {
  readonly source: LightSource;
  /** What is to be looked at: the source itself, or for a stream a video of it. */
  readonly picture: LightPicture;
  readonly projection: Projection;
  readonly #listener: SourceListener;
  #following: AbortController | null = null;
  #fault: PhotoError | null = null;
  /** What was to be seen when it was last looked at. */
  #seen: string;

  constructor(source: LightSource, listener: SourceListener) {
    this.source = source;
    this.picture = isA('MediaStream', source) ? silentVideo() : source;
    this.projection = new Projected(this.picture);
    this.#listener = listener;
    this.#seen = stateOf(this.picture);
  }

  /** Why nothing is to be seen. */
  get fault(): PhotoError | null {
    return this.#fault;
  }

  /** Tells of every change from now on, and whether there was one since it stopped. */
  start(): void {
    if (this.#following) return;
    this.#following = new AbortController();
    const { signal } = this.#following;
    const { source, picture } = this;
    if (isA('HTMLImageElement', picture)) this.#followImage(picture, signal);
    if (isA('HTMLVideoElement', picture)) this.#followVideo(picture, signal);
    if (isA('MediaStream', source)) this.#play(source, picture as HTMLVideoElement, signal);
    if (stateOf(picture) !== this.#seen) this.#changed();
  }

  stop(): void {
    if (!this.#following) return;
    this.#following.abort();
    this.#following = null;
    this.#seen = stateOf(this.picture);
  }

  #followImage(image: HTMLImageElement, signal: AbortSignal): void {
    const fail = () => {
      const message = `The image that is the light could not be loaded: ${image.currentSrc}`;
      this.#fail(new PhotoError('light-source', message));
    };
    // Decoded beside the page, which would wait for it when it is first drawn. One that is given
    // another address meanwhile rejects, and loads again.
    const take = () =>
      image.decode().then(
        () => signal.aborted || this.#changed(),
        () => signal.aborted || !image.complete || fail(),
      );
    image.addEventListener('load', take, { signal });
    image.addEventListener('error', fail, { signal });
    if (image.complete && image.currentSrc && image.naturalWidth === 0) fail();
  }

  #followVideo(video: HTMLVideoElement, signal: AbortSignal): void {
    const fail = () => {
      const said = video.error?.message || 'it does not know the format, or was not sent the file.';
      const message = `The video that is the light cannot be played. The browser says: ${said}`;
      this.#fail(new PhotoError('light-source', message, video.error));
    };
    const changed = () => this.#changed();
    // New frames are told while it plays, on some browsers only then.
    video.addEventListener('loadeddata', changed, { signal });
    video.addEventListener('seeked', changed, { signal });
    video.addEventListener('error', fail, { signal });
    if (video.error) fail();
    eachFrame(video, changed, signal);
  }

  #play(stream: MediaStream, video: HTMLVideoElement, signal: AbortSignal): void {
    // The tracks are the page's: they go on without this.
    signal.addEventListener('abort', () => {
      video.pause();
      video.srcObject = null;
    });
    const ended = () => {
      const message =
        'The stream that is the light has ended, or what it came from was taken away.';
      this.#fail(new PhotoError('light-source', message));
    };
    video.addEventListener('ended', ended, { signal });
    if (stream.active === false) ended();
    video.srcObject = stream;
    video.play().catch((cause: unknown) => {
      if (signal.aborted) return;
      const message = `The stream that is the light cannot be played: ${messageOf(cause)}`;
      this.#fail(new PhotoError('light-source', message, cause));
    });
  }

  #changed(): void {
    if (this.#fault) {
      this.#fault = null;
      this.#listener.faultChanged(null);
    }
    this.#listener.changed();
  }

  #fail(fault: PhotoError): void {
    if (fault.message === this.#fault?.message) return;
    this.#fault = fault;
    this.#listener.faultChanged(fault);
  }
}

/** Calls back for each frame that a video shows. */
function eachFrame(video: HTMLVideoElement, tell: () => void, signal: AbortSignal): void {
  let handle = 0;
  if (typeof video.requestVideoFrameCallback === 'function') {
    const next = () => {
      handle = video.requestVideoFrameCallback(() => {
        next();
        tell();
      });
    };
    signal.addEventListener('abort', () => video.cancelVideoFrameCallback(handle));
    next();
    return;
  }
  const next = () => {
    handle = requestAnimationFrame(() => {
      if (video.paused || video.ended) return;
      next();
      tell();
    });
  };
  const begin = () => {
    cancelAnimationFrame(handle);
    next();
  };
  video.addEventListener('playing', begin, { signal });
  signal.addEventListener('abort', () => cancelAnimationFrame(handle));
  if (!video.paused) begin();
}

/** Changes wherever what is to be seen may have, as far as a picture tells of itself. */
function stateOf(picture: LightPicture): string {
  if (isA('HTMLImageElement', picture)) return `${picture.complete} ${picture.currentSrc}`;
  if (isA('HTMLVideoElement', picture)) {
    return `${picture.readyState >= 2} ${picture.currentTime} ${picture.currentSrc}`;
  }
  return '';
}

/** One that browsers let play without a click, and within the page. */
function silentVideo(): HTMLVideoElement {
  const video = document.createElement('video');
  video.muted = true;
  video.playsInline = true;
  return video;
}
