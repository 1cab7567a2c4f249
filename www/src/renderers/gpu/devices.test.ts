import assert from 'node:assert/strict';
import test from 'node:test';
import type { Graphics } from '../../engine/types.js';
import { Devices, type LoadGraphics } from './devices.js';
import type { GraphicsPorts } from './graphics-ports.js';

const settle = () => new Promise((resolve) => setImmediate(resolve));

/** A page whose devices the test loses, and a module that notes what becomes of them. */
function world() {
  const log: string[] = [];
  const loses: ((message: string) => void)[] = [];
  const canvases: { lose(): void }[] = [];
  let now = 0;
  let missing: Error | null = null;
  let silent = false;
  let unanswered = 0;
  const device = (name: string, lost: Graphics['lost']): Graphics => ({
    kernel: name,
    lost,
    draw: () => Promise.reject(new Error('not here')),
    free: () => log.push(`free ${name}`),
  });
  const module = {
    Graphics: {
      webgpu: async () => {
        if (missing) throw missing;
        if (silent) {
          unanswered += 1;
          return new Promise<never>(() => {});
        }
        const number = loses.length;
        const lost = new Promise<{ message: string }>((resolve) => {
          loses.push((message) => resolve({ message }));
        });
        return device(`webgpu ${number}`, lost);
      },
      webgl2: () => {
        if (missing) throw missing;
        return device(`webgl2 ${canvases.length - 1}`, undefined);
      },
    },
  };
  const load = (async () => module) as unknown as LoadGraphics;
  let name: string | null = 'A real one';
  let asked = 0;
  const ports: GraphicsPorts = {
    nameOf: async () => {
      asked += 1;
      return name;
    },
    createCanvas: () => {
      let lose = (): void => {};
      canvases.push({ lose: () => lose() });
      const addEventListener = (_: string, listener: () => void) => {
        lose = listener;
      };
      return { addEventListener } as unknown as HTMLCanvasElement;
    },
    now: () => now,
  };
  return {
    devices: new Devices(ports, 20),
    load,
    /** Devices are called that from now on; `null`: there are none. */
    call: (other: string | null) => {
      name = other;
    },
    asked: () => asked,
    loses,
    canvases,
    unanswered: () => unanswered,
    happened: () => log.splice(0),
    note: (name: string) => (reason: string) => log.push(`${name}: ${reason}`),
    pass: (ms: number) => {
      now += ms;
    },
    miss: (error: Error | null) => {
      missing = error;
    },
    fallSilent: () => {
      silent = true;
    },
  };
}

for (const backend of ['webgpu', 'webgl2'] as const) {
  test(`all who ask for ${backend} at once share one device, which goes with the last`, async () => {
    const w = world();
    const leases = await Promise.all(
      ['a', 'b', 'c'].map((name) => w.devices.lease(w.load, backend, true, w.note(name))),
    );
    assert.equal(new Set(leases.map(({ graphics }) => graphics)).size, 1);
    for (const { release } of leases.slice(1)) release();
    await settle();
    assert.deepEqual(w.happened(), []);
    leases[0]?.release();
    leases[0]?.release();
    await settle();
    assert.deepEqual(w.happened(), [`free ${backend} 0`]);
    // What it says when it is let go is no loss.
    w.loses[0]?.('destroyed');
    w.canvases[0]?.lose();
    await settle();
    assert.deepEqual(w.happened(), []);
    const next = await w.devices.lease(w.load, backend, true, w.note('d'));
    assert.equal(next.graphics.kernel, `${backend} 1`);
  });

  test(`all who share ${backend} are told once that it was lost, and the next gets another`, async () => {
    const w = world();
    const lose = (i: number) =>
      backend === 'webgpu' ? w.loses[i]?.('gone.') : w.canvases[i]?.lose();
    const leases = await Promise.all(
      ['a', 'b'].map((name) => w.devices.lease(w.load, backend, true, w.note(name))),
    );
    lose(0);
    lose(0);
    await settle();
    leases[0]?.fail('a draw failed');
    const reason = backend === 'webgpu' ? 'gone.' : 'the browser took it away.';
    assert.deepEqual(w.happened().sort(), [`a: ${reason}`, `b: ${reason}`, `free ${backend} 0`]);
    const next = await w.devices.lease(w.load, backend, true, w.note('c'));
    for (const { release } of leases) release();
    await settle();
    assert.deepEqual(w.happened(), [], 'the one that was lost takes nothing of the next along');
    next.fail('a draw failed');
    await settle();
    assert.deepEqual(w.happened(), ['c: a draw failed', `free ${backend} 1`]);
  });
}

test('a device that is lost again and again is refused for a while', async () => {
  const w = world();
  for (let i = 0; i < 3; i += 1) {
    await w.devices.lease(w.load, 'webgpu', true, w.note('a'));
    w.loses[i]?.('gone.');
    await settle();
    w.pass(10_000);
  }
  const refused = { code: 'backend-unavailable', message: /lost 3 times/ };
  await assert.rejects(w.devices.lease(w.load, 'webgpu', true, w.note('a')), refused);
  assert.ok(await w.devices.lease(w.load, 'webgl2', true, w.note('a')), 'another is had');
  w.pass(60_000);
  for (let i = 3; i < 8; i += 1) {
    await w.devices.lease(w.load, 'webgpu', true, w.note('a'));
    w.loses[i]?.('gone.');
    await settle();
    w.pass(70_000);
  }
});

test('a device that cannot be had is asked for again by the next', async () => {
  for (const backend of ['webgpu', 'webgl2'] as const) {
    const w = world();
    w.miss(new Error('none here'));
    await assert.rejects(w.devices.lease(w.load, backend, true, w.note('a')), /none here/);
    w.miss(null);
    assert.ok(await w.devices.lease(w.load, backend, true, w.note('a')));
  }
});

test('a browser that never answers has no device', async () => {
  const w = world();
  w.fallSilent();
  const asked = w.devices.lease(w.load, 'webgpu', true, w.note('a'));
  const message = /does not answer within/;
  await assert.rejects(asked, { code: 'backend-unavailable', message });
  // Nor does anyone wait for it again.
  const again = w.devices.lease(w.load, 'webgpu', true, w.note('b'));
  await assert.rejects(again, { code: 'backend-unavailable', message });
  assert.equal(w.unanswered(), 1);
});

test('where there is no device, its module is not loaded, and the next asks again', async () => {
  for (const backend of ['webgpu', 'webgl2'] as const) {
    const w = world();
    w.call(null);
    const load = (() => assert.fail('it is of no use')) as unknown as LoadGraphics;
    await assert.rejects(w.devices.lease(load, backend, true, w.note('a')), {
      code: 'backend-unavailable',
      message: /has no device/,
    });
    w.call('A real one');
    assert.ok(await w.devices.lease(w.load, backend, true, w.note('a')));
    await w.devices.lease(w.load, backend, true, w.note('b'));
    assert.equal(w.asked(), 2, 'once there is one, it is known');
  }
});

test('the module of a device that is a program is loaded only for who takes one', async () => {
  for (const name of [
    'google swiftshader',
    'ANGLE (Mesa, llvmpipe (LLVM 19.1))',
    'Microsoft Basic Render Driver',
  ]) {
    const w = world();
    w.call(name);
    const load = (() => assert.fail('it is of no use')) as unknown as LoadGraphics;
    const refused = w.devices.lease(load, 'webgl2', false, w.note('a'));
    await assert.rejects(refused, {
      code: 'backend-unavailable',
      message: /software renderer/,
    });
    assert.ok(await w.devices.lease(w.load, 'webgl2', true, w.note('b')));
  }
  const w = world();
  w.call('nvidia lovelace');
  assert.ok(await w.devices.lease(w.load, 'webgpu', false, w.note('a')));
});

test('a browser that never tells a name has no device', async () => {
  const w = world();
  const ports = {
    nameOf: () => new Promise<never>(() => {}),
    createCanvas: assert.fail,
    now: () => 0,
  };
  const devices = new Devices(ports, 20);
  await assert.rejects(devices.lease(w.load, 'webgpu', true, w.note('a')), {
    code: 'backend-unavailable',
    message: /does not answer within/,
  });
});

test('a browser that answers late is asked again', async () => {
  const w = world();
  let answer = (_: string): void => {};
  const names = [
    new Promise<string>((resolve) => {
      answer = resolve;
    }),
    Promise.resolve('A real one'),
  ];
  const ports = {
    nameOf: () => names.shift() ?? Promise.resolve(null),
    createCanvas: assert.fail,
    now: () => 0,
  };
  const devices = new Devices(ports, 20);
  const lease = () => devices.lease(w.load, 'webgpu', true, w.note('a'));
  await assert.rejects(lease(), /does not answer within/);
  answer('A real one');
  await settle();
  assert.ok(await lease());
});

test('what takes the place of a lost device is asked its name', async () => {
  const w = world();
  await w.devices.lease(w.load, 'webgpu', false, w.note('a'));
  w.call('google swiftshader');
  w.loses[0]?.('gone.');
  await settle();
  await assert.rejects(w.devices.lease(w.load, 'webgpu', false, w.note('a')), /software renderer/);
});
