/**
 * Turns input by pointer, wheel, keyboard and tilt into changes of the viewer's state, and runs its animations. It is a
 * separate script, because the first picture needs none of it.
 */

import { missingScript, type PhotoError } from '../shared/errors.js';
import { callLater } from '../shared/promises.js';
import { CENTRE, type PicturePoint } from '../shared/value-types.js';
import type { ViewerState } from '../state/viewer-state.js';
import {
  FULL_VIEW,
  pan,
  toggleZoom,
  toPicture,
  ZOOM_STEP,
  type ZoomView,
  zoomAt,
} from '../state/viewport.js';
import { adoptStyles } from '../ui/adopted-styles.js';
import { updateAttribute } from '../ui/dom-helpers.js';
import type { ShadowDom } from '../ui/shadow-dom.js';
import type { ViewerUi } from '../ui/viewer-ui.js';
import { AnimationLoop } from './animation-loop.js';
import type { EnabledGestures } from './gestures.js';
import { IdleTimer } from './idle-timer.js';
import { glide, MIN_GLIDE_SPEED, speedOf, type Velocity } from './inertia.js';
import INPUT_CSS from './input.css';
import { type FocusedPart, type KeyAction, keyAction } from './keys.js';
import { LightAnimator } from './light-animator.js';
import { describeLight } from './light-description.js';
import type { Minimap } from './minimap.js';
import { listenToPointer, toViewportUnits } from './pointer-input.js';
import { reducedMotion } from './reduced-motion.js';
import { isTiltSupported, TiltSensor } from './tilt-sensor.js';
import {
  durationOf,
  type TransitionOptions,
  Transitions,
  torchTransition,
  viewBetween,
} from './transitions.js';
import { ZoomHint } from './zoom-hint.js';

/** A glide that is limited by more than the rounding of views is at an edge of the picture. */
const EDGE = 1e-3;

export interface InteractionCallbacks {
  /** The light, the view, an animation or the focus has changed. */
  changed(): void;
  /** The kiosk's time without input is over. */
  expired(): void;
  /** The overview has appeared or disappeared. It needs a new frame, as graphics devices keep no picture. */
  overviewChanged(isShown: boolean): void;
  failed(error: PhotoError): void;
}

export class InteractionController {
  readonly #tilt: TiltSensor;
  readonly #loop = new AnimationLoop(requestAnimationFrame.bind(globalThis));
  readonly #animator: LightAnimator;
  readonly #transitions = new Transitions(this.#loop);
  readonly #idle: IdleTimer;
  readonly #hint = new ZoomHint();
  #isActive = false;
  /** The space key is held: drags pan. */
  #isPanning = false;
  /** The torch handle has the keyboard's focus: a light that a screen reader describes must not move. */
  #isHandleFocused = false;
  #torchBeforeMove: PicturePoint | null = null;
  #minimap: Minimap | null = null;
  #minimapFetch: Promise<void> | null = null;

  constructor(
    private readonly state: ViewerState,
    private readonly dom: ShadowDom,
    private readonly viewerUi: ViewerUi,
    private readonly listener: InteractionCallbacks,
  ) {
    adoptStyles(dom.root, INPUT_CSS);
    dom.contentBox.append(this.#hint.element);
    this.#animator = new LightAnimator(state.light, this.#loop, () => listener.changed());
    this.#idle = new IdleTimer(callLater, {
      rested: () => {
        this.#isActive = false;
        listener.changed();
      },
      expired: () => {
        listener.expired();
        viewerUi.toolbar?.closeMenu();
        this.#leaveFullscreen();
      },
    });
    this.#tilt = new TiltSensor((point) => {
      if (!state.light.isTorch) return;
      this.markActive();
      this.#moveTorch(point);
    });
    this.#listenToPointer();
    this.#listenToKeyboard();
  }

  /** Describes the light, and starts and stops animations. */
  update(isPlaying: boolean): void {
    const { light, isPictureShown, options, reveal } = this.state;
    const description = describeLight(light.torch ?? CENTRE, this.viewerUi);
    updateAttribute(this.dom.handle, 'aria-valuetext', description);
    this.#idle.kioskSeconds = options.kioskSeconds;
    this.#loop.isEnabled = reveal.isVisible;
    if (!reveal.isVisible) this.#transitions.finish();
    if (!reveal.isVisible || !isPictureShown || reducedMotion().matches) this.#stopGlide();
    const isInUse =
      this.#isActive ||
      this.#isHandleFocused ||
      this.#tilt.isActive ||
      this.#transitions.isRunning('light');
    this.#updateMinimap();
    const isAnimated = isPlaying && isPictureShown;
    this.#animator.update({
      fire: isAnimated && light.isFire,
      wander: isAnimated && options.autoplayLight && light.isTorch && !isInUse,
    });
  }

  /** The canvas has another picture. */
  frameDrawn(): void {
    const canvas = this.dom.content.querySelector('canvas');
    if (canvas) this.#minimap?.draw(canvas);
  }

  markActive(byKeyboard = false): void {
    this.#isActive = true;
    this.#idle.restart();
    this.viewerUi.toolbar?.show(byKeyboard);
  }

  /** Whether the torch follows the device's tilt; `null` if it cannot. */
  get isTilting(): boolean | null {
    return this.state.light.isTorch && isTiltSupported() ? this.#tilt.isActive : null;
  }

  toggleTilt(): void {
    if (this.#tilt.isActive) this.reset();
    else void this.requestTilt();
    this.listener.changed();
  }

  async requestTilt(): Promise<boolean> {
    const isGranted = await this.#tilt.request();
    this.listener.changed();
    return isGranted;
  }

  /** Ends tilting, gliding and wandering. */
  reset(): void {
    this.#tilt.stop();
    this.stopTorch();
    this.stopView();
    this.#isActive = false;
  }

  /** Another position is about to be set. */
  stopTorch(): void {
    this.#animator.stopTorch();
    this.#transitions.end('light');
  }

  stopView(): void {
    this.#transitions.end('view');
    this.#stopGlide();
  }

  /** Lets the torch move from its current position to that of the light which `set` sets. */
  lightTo(set: () => void, options: TransitionOptions): Promise<void> {
    const ms = durationOf(options);
    this.stopTorch();
    const show = torchTransition(this.state, set);
    return this.#run('light', ms, show);
  }

  /** Moves to another view. */
  viewTo(view: ZoomView, options: TransitionOptions): Promise<void> {
    const ms = durationOf(options);
    this.stopView();
    const from = this.state.view;
    return this.#run('view', ms, (at) => {
      this.state.view = viewBetween(from, view, at);
    });
  }

  /** Nothing moves where nobody can see it, or where less motion is asked for. */
  #run(name: 'light' | 'view', ms: number, show: (at: number) => void): Promise<void> {
    const { isPictureShown, reveal } = this.state;
    const isSeen = isPictureShown && reveal.isVisible && !reducedMotion().matches;
    return this.#transitions.run(name, isSeen ? ms : 0, (at) => {
      show(at);
      this.listener.changed();
    });
  }

  /** Magnifies around the centre by one step. */
  zoom(by: 1 | -1): void {
    this.#zoomAt(ZOOM_STEP ** by, CENTRE);
  }

  stop(): void {
    this.reset();
    this.#idle.stop();
    this.#loop.clear();
  }

  #listenToPointer(): void {
    const state = this.state;
    const { handle, root, viewport } = this.dom;
    // Also over the toolbar, and under a light that does not move; first, so that the torch does not wander on.
    const markActive = () => {
      if (state.isPictureShown) this.markActive();
    };
    for (const type of ['pointermove', 'pointerdown']) {
      root.addEventListener(type, markActive, { capture: true });
    }
    const toUnits = (x: number, y: number) => toViewportUnits(viewport, x, y);
    listenToPointer(viewport, {
      permissions: () => this.#permissions,
      isPanning: () => this.#isPanning,
      isCooperative: () => state.options.cooperativeGestures,
      zoomIgnored: (by) => this.#hint.show(by, this.viewerUi),
      active: () => this.markActive(),
      pressed: () => (handle.hidden ? viewport : handle).focus({ preventScroll: true }),
      moveLight: (x, y) => {
        this.#torchBeforeMove = state.light.torch;
        this.#moveTorch(toPicture(state.view, toUnits(x, y)));
      },
      restoreLight: () => {
        state.light.torch = this.#torchBeforeMove;
        this.listener.changed();
      },
      throwLight: ({ x, y }: Velocity) => {
        if (reducedMotion().matches) return;
        const { zoom } = state.view;
        const velocity = toUnits(x, y);
        this.#animator.throwTorch({ x: velocity.x / zoom, y: velocity.y / zoom });
      },
      pan: (dx, dy) => {
        const moved = toUnits(dx, dy);
        this.#setView(pan(state.view, moved.x, moved.y));
      },
      holdView: () => this.#stopGlide(),
      throwView: ({ x, y }: Velocity) => this.#throwView(toUnits(x, y)),
      zoom: (factor, x, y) => this.#zoomAt(factor, toUnits(x, y)),
      doubleTap: (x, y) =>
        this.#setView(toggleZoom(state.view, toUnits(x, y), state.options.maxZoom)),
    });
  }

  #listenToKeyboard(): void {
    const { root, handle } = this.dom;
    root.addEventListener('keydown', (event) => this.#keyDown(event as KeyboardEvent));
    root.addEventListener('keyup', (event) => {
      if ((event as KeyboardEvent).key === ' ') this.#isPanning = false;
    });
    const focusChanged = () => {
      // A press with a pointer focuses the handle without :focus-visible.
      this.#isHandleFocused = handle.matches(':focus-visible');
      this.#isPanning = false;
      this.listener.changed();
    };
    // The focus may be older than this script.
    this.#isHandleFocused = handle.matches(':focus-visible');
    handle.addEventListener('focus', focusChanged);
    handle.addEventListener('blur', focusChanged);
  }

  get #permissions(): EnabledGestures {
    const { light, options, isPictureShown, view } = this.state;
    return {
      movesLight: isPictureShown && light.isTorch,
      zooms: isPictureShown && options.maxZoom > 1,
      isZoomed: view.zoom > 1,
    };
  }

  /** Returns whether the element was in full screen. */
  #leaveFullscreen(): boolean {
    const wasFullscreen = this.dom.root.host.matches(':fullscreen');
    if (wasFullscreen) document.exitFullscreen().catch(() => {});
    return wasFullscreen;
  }

  #moveTorch(point: PicturePoint): void {
    this.stopTorch();
    this.state.light.torch = point;
    this.listener.changed();
  }

  /** Lets the view glide on; the velocity is in views per second. */
  #throwView(initial: Velocity): void {
    this.stopView();
    if (reducedMotion().matches) return;
    let velocity = initial;
    // Views are rounded: small steps of them would be lost.
    let view = this.state.view;
    this.#loop.set('view glide', (seconds) => {
      const next = glide(velocity, seconds);
      velocity = next.velocity;
      view = pan(view, next.moved.x, next.moved.y);
      this.state.view = view;
      this.listener.changed();
      const { x, y } = this.state.view;
      const isAtCorner = Math.abs(x - view.x) > EDGE && Math.abs(y - view.y) > EDGE;
      return !isAtCorner && speedOf(velocity) > MIN_GLIDE_SPEED;
    });
  }

  #stopGlide(): void {
    this.#loop.set('view glide', null);
  }

  /** The overview of a magnified picture, for elements with the attribute. */
  #updateMinimap(): void {
    const { options, view, isPictureShown } = this.state;
    const isWanted = options.minimap && isPictureShown && view.zoom > 1;
    const minimap = this.#minimap;
    if (!isWanted || minimap) {
      if (minimap?.show(isWanted ? view : null)) this.listener.overviewChanged(minimap.isShown);
      return;
    }
    this.#minimapFetch ??= import('./minimap.js').then(
      ({ Minimap }) => {
        this.#minimap = new Minimap(this.dom, (x, y) => {
          this.markActive();
          this.#setView({ ...this.state.view, x, y });
        });
        this.listener.changed();
      },
      (cause: unknown) =>
        this.listener.failed(missingScript('minimap-unavailable', 'the overview', cause)),
    );
  }

  #zoomAt(factor: number, at: PicturePoint): boolean {
    const { view, options } = this.state;
    return this.#setView(zoomAt(view, factor, at, options.maxZoom));
  }

  /** Sets the nearest view inside the picture. Returns whether the view has changed. */
  #setView(view: ZoomView): boolean {
    this.stopView();
    const last = this.state.view;
    this.state.view = view;
    const hasChanged = this.state.view !== last;
    if (hasChanged) {
      this.viewerUi.announce('zoomed');
      this.listener.changed();
    }
    return hasChanged;
  }

  #keyDown(event: KeyboardEvent): void {
    const focus = this.#focusTarget(event.target);
    if (!focus) return;
    this.markActive(true);
    if (event.key === ' ' && focus !== 'controls') {
      this.#isPanning = true;
      event.preventDefault();
      return;
    }
    const action = keyAction(event, focus);
    if (action && this.#perform(action)) event.preventDefault();
  }

  #focusTarget(target: EventTarget | null): FocusedPart | null {
    if (target === this.dom.handle) return 'light';
    if (target === this.dom.viewport) return 'picture';
    const isControl =
      target instanceof Element && target.closest('[role=toolbar], [role=radiogroup]');
    return isControl ? 'controls' : null;
  }

  /** Returns whether the key was used. */
  #perform(action: KeyAction): boolean {
    const { light, options, view } = this.state;
    const torch = light.torch ?? CENTRE;
    switch (action.kind) {
      case 'move-light':
        this.#moveTorch({ x: torch.x + action.dx, y: torch.y + action.dy });
        return true;
      case 'pan':
        return this.#setView(pan(view, action.dx, action.dy));
      case 'zoom':
        if (options.maxZoom > 1) this.zoom(action.by);
        return options.maxZoom > 1;
      case 'reset-view':
        return this.#setView(FULL_VIEW);
      case 'actual-size':
        return this.#setView({ ...view, zoom: this.dom.actualSizeZoom });
      case 'select-light':
        this.stopTorch();
        this.state.selectNextLight(action.by);
        this.viewerUi.announce('light');
        this.listener.changed();
        return true;
      case 'escape':
        if (this.#leaveFullscreen()) return false;
        (this.dom.root.activeElement as HTMLElement | null)?.blur();
        return false;
    }
  }
}
