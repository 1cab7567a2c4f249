import assert from 'node:assert/strict';
import test from 'node:test';
import type { GraphicsDevice } from '../../engine/wasm-exports.js';
import { Deferred } from '../../shared/promises.js';
import { type DevicePreferences, Devices, type LoadGraphics } from './devices.js';
import type { GraphicsPorts } from './graphics-ports.js';

const backends = ['webgpu', 'webgl2', 'cpu'] as const;
const SOFTWARE = { backends, software: true };
const NO_SOFTWARE = { backends, software: false };

const settle = () => new Promise((resolve) => setImmediate(resolve));

/** Devices that the test loses, and a log of what happens to them. */
function fakeDevices() {
  const log: string[] = [];
  const losses: ((message: string) => void)[] = [];
  const canvases: { lose(): void }[] = [];
  let now = 0;
  let openError: Error | null = null;
  let silent = false;
  let opens: Promise<void> = Promise.resolve();
  let unanswered = 0;
  const device = (name: string, lost: GraphicsDevice['lost']): GraphicsDevice => ({
    kernel: name,
    lost,
    draw: () => Promise.reject(new Error('not here')),
    free: () => log.push(`free ${name}`),
  });
  const module = {
    GraphicsDevice: {
      webgpu: async () => {
        if (openError) throw openError;
        if (silent) {
          unanswered += 1;
          return new Promise<never>(() => {});
        }
        await opens;
        const number = losses.length;
        const lost = new Promise<{ message: string }>((resolve) => {
          losses.push((message) => resolve({ message }));
        });
        return device(`webgpu ${number}`, lost);
      },
      webgl2: () => {
        if (openError) throw openError;
        return device(`webgl2 ${canvases.length - 1}`, undefined);
      },
    },
  };
  const load = (async () => module) as unknown as LoadGraphics;
  let name: string | null = 'A real device';
  let nameRequests = 0;
  const ports: GraphicsPorts = {
    nameOf: async () => {
      nameRequests += 1;
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
    /** Sets the name of the adapter; `null` if there is none. */
    setName: (other: string | null) => {
      name = other;
    },
    nameRequests: () => nameRequests,
    losses,
    canvases,
    unanswered: () => unanswered,
    takeLog: () => log.splice(0),
    onLost: (name: string) => (reason: string) => log.push(`${name}: ${reason}`),
    pass: (ms: number) => {
      now += ms;
    },
    setError: (error: Error | null) => {
      openError = error;
    },
    /** Devices open once the returned function is called. */
    openLate: () => {
      const late = new Deferred();
      opens = late.promise;
      return late.resolve;
    },
    fallSilent: () => {
      silent = true;
    },
  };
}

for (const backend of ['webgpu', 'webgl2'] as const) {
  test(`simultaneous leases of ${backend} share a device, which is freed with the last`, async () => {
    const f = fakeDevices();
    const leases = await Promise.all(
      ['a', 'b', 'c'].map((name) => f.devices.lease(f.load, backend, SOFTWARE, f.onLost(name))),
    );
    assert.equal(new Set(leases.map(({ graphics }) => graphics)).size, 1);
    for (const { release } of leases.slice(1)) release();
    await settle();
    assert.deepEqual(f.takeLog(), []);
    leases[0]?.release();
    leases[0]?.release();
    await settle();
    assert.deepEqual(f.takeLog(), [`free ${backend} 0`]);
    // The loss of a device that was freed is ignored.
    f.losses[0]?.('destroyed');
    f.canvases[0]?.lose();
    await settle();
    assert.deepEqual(f.takeLog(), []);
    const next = await f.devices.lease(f.load, backend, SOFTWARE, f.onLost('d'));
    assert.equal(next.graphics.kernel, `${backend} 1`);
  });

  test(`all leases of ${backend} report a loss once, and the next gets a new device`, async () => {
    const f = fakeDevices();
    const lose = (i: number) =>
      backend === 'webgpu' ? f.losses[i]?.('gone.') : f.canvases[i]?.lose();
    const leases = await Promise.all(
      ['a', 'b'].map((name) => f.devices.lease(f.load, backend, SOFTWARE, f.onLost(name))),
    );
    lose(0);
    lose(0);
    await settle();
    leases[0]?.fail('a draw failed');
    const reason = backend === 'webgpu' ? 'gone.' : 'the browser took it away.';
    assert.deepEqual(f.takeLog().sort(), [`a: ${reason}`, `b: ${reason}`, `free ${backend} 0`]);
    const next = await f.devices.lease(f.load, backend, SOFTWARE, f.onLost('c'));
    for (const { release } of leases) release();
    await settle();
    assert.deepEqual(f.takeLog(), [], 'the lost device does not affect the next');
    next.fail('a draw failed');
    await settle();
    assert.deepEqual(f.takeLog(), ['c: a draw failed', `free ${backend} 1`]);
  });
}

test('a device that is lost repeatedly is refused for a minute', async () => {
  const f = fakeDevices();
  for (let i = 0; i < 3; i += 1) {
    await f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a'));
    f.losses[i]?.('gone.');
    await settle();
    f.pass(10_000);
  }
  const refused = { code: 'backend-unavailable', message: /lost 3 times/ };
  await assert.rejects(f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a')), refused);
  assert.ok(
    await f.devices.lease(f.load, 'webgl2', SOFTWARE, f.onLost('a')),
    'the other backend is available',
  );
  f.pass(60_000);
  for (let i = 3; i < 8; i += 1) {
    await f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a'));
    f.losses[i]?.('gone.');
    await settle();
    f.pass(70_000);
  }
});

test('a device that failed to open is opened again by the next lease', async () => {
  for (const backend of ['webgpu', 'webgl2'] as const) {
    const f = fakeDevices();
    f.setError(new Error('none here'));
    await assert.rejects(f.devices.lease(f.load, backend, SOFTWARE, f.onLost('a')), /none here/);
    f.setError(null);
    assert.ok(await f.devices.lease(f.load, backend, SOFTWARE, f.onLost('a')));
  }
});

test('a browser that does not answer has no device', async () => {
  const f = fakeDevices();
  f.fallSilent();
  const asked = f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a'));
  const message = /does not answer within/;
  await assert.rejects(asked, { code: 'backend-unavailable', message });
  // The next lease does not wait.
  const again = f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('b'));
  await assert.rejects(again, { code: 'backend-unavailable', message });
  assert.equal(f.unanswered(), 1);
});

test('without a device its module is not loaded, and the next lease asks again', async () => {
  for (const backend of ['webgpu', 'webgl2'] as const) {
    const f = fakeDevices();
    f.setName(null);
    const load = (() => assert.fail('it is not needed')) as unknown as LoadGraphics;
    await assert.rejects(f.devices.lease(load, backend, SOFTWARE, f.onLost('a')), {
      code: 'backend-unavailable',
      message: /has no device/,
    });
    f.setName('A real device');
    assert.ok(await f.devices.lease(f.load, backend, SOFTWARE, f.onLost('a')));
    await f.devices.lease(f.load, backend, SOFTWARE, f.onLost('b'));
    assert.equal(f.nameRequests(), 2, 'a name is kept');
  }
});

test('the module of a software renderer is loaded only on request', async () => {
  for (const name of [
    'google swiftshader',
    'ANGLE (Mesa, llvmpipe (LLVM 19.1))',
    'Microsoft Basic Render Driver',
  ]) {
    const f = fakeDevices();
    f.setName(name);
    const load = (() => assert.fail('it is not needed')) as unknown as LoadGraphics;
    const refused = f.devices.lease(load, 'webgl2', NO_SOFTWARE, f.onLost('a'));
    await assert.rejects(refused, {
      code: 'backend-unavailable',
      message: /software renderer/,
    });
    assert.ok(await f.devices.lease(f.load, 'webgl2', SOFTWARE, f.onLost('b')));
  }
  const f = fakeDevices();
  f.setName('nvidia lovelace');
  assert.ok(await f.devices.lease(f.load, 'webgpu', NO_SOFTWARE, f.onLost('a')));
});

test('a browser that does not give a name has no device', async () => {
  const f = fakeDevices();
  const ports = {
    nameOf: () => new Promise<never>(() => {}),
    createCanvas: assert.fail,
    now: () => 0,
  };
  const devices = new Devices(ports, 20);
  await assert.rejects(devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a')), {
    code: 'backend-unavailable',
    message: /does not answer within/,
  });
});

test('a lease that is cancelled ends at once, and the next uses its request', async () => {
  const f = fakeDevices();
  const open = f.openLate();
  const abort = new AbortController();
  const only = { backends: ['webgpu'] as const, software: true };
  const cancelled = f.devices.lease(f.load, 'webgpu', only, f.onLost('a'), abort.signal);
  await settle();
  abort.abort(new Error('cancelled'));
  await assert.rejects(cancelled, /cancelled/);
  const next = f.devices.lease(f.load, 'webgpu', only, f.onLost('b'));
  await settle();
  open();
  assert.equal((await next).graphics.kernel, 'webgpu 0');
  await settle();
  assert.deepEqual(f.takeLog(), [], 'the device is in use');
});

test('a device that opens late is waited for where no other backend is left', async () => {
  const f = fakeDevices();
  const open = f.openLate();
  const only = { backends: ['webgpu'] as const, software: true };
  const patient = f.devices.lease(f.load, 'webgpu', only, f.onLost('a'));
  await assert.rejects(
    f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('b')),
    /does not answer within/,
  );
  f.pass(20);
  // Another that has waited long enough fails at once.
  await assert.rejects(
    f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('c')),
    /does not answer within/,
  );
  open();
  assert.equal((await patient).graphics.kernel, 'webgpu 0');
  const after = await f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('d'));
  assert.equal(after.graphics, (await patient).graphics);
});

test('an answer that comes late is used', async () => {
  const f = fakeDevices();
  let answer = (_: string): void => {};
  const names = [
    new Promise<string>((resolve) => {
      answer = resolve;
    }),
    Promise.resolve('A real device'),
  ];
  const ports = {
    nameOf: () => names.shift() ?? Promise.resolve(null),
    createCanvas: assert.fail,
    now: () => 0,
  };
  const devices = new Devices(ports, 20);
  const lease = () => devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a'));
  await assert.rejects(lease(), /does not answer within/);
  answer('A real device');
  await settle();
  assert.ok(await lease());
});

test('a browser that answers late is waited for where no other backend is left', async () => {
  const f = fakeDevices();
  const name = new Deferred<string>();
  const ports = { nameOf: () => name.promise, createCanvas: assert.fail, now: () => 0 };
  const devices = new Devices(ports, 20);
  const lease = (preferences: DevicePreferences) =>
    devices.lease(f.load, 'webgpu', preferences, f.onLost('a'));
  const patient = lease({ backends: ['webgpu'], software: true });
  await assert.rejects(lease(SOFTWARE), /does not answer within 0.02 seconds/);
  const alsoPatient = lease({ backends: ['webgpu'], software: true });
  name.resolve('A real device');
  assert.equal((await patient).graphics, (await alsoPatient).graphics);
  assert.ok(await lease(SOFTWARE), 'the late answer is known');
  const silent = { ...ports, nameOf: () => new Promise<never>(() => {}) };
  const impatient = new Devices(silent, 20, 30);
  await assert.rejects(
    impatient.lease(f.load, 'webgpu', { backends: ['webgpu'], software: true }, f.onLost('b')),
    /does not answer within 0.03 seconds/,
  );
});

test('a device that opens after the time limit is freed', async () => {
  const f = fakeDevices();
  const open = f.openLate();
  await assert.rejects(
    f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a')),
    /does not answer within/,
  );
  open();
  await settle();
  assert.deepEqual(f.takeLog(), ['free webgpu 0']);
  assert.ok(await f.devices.lease(f.load, 'webgpu', SOFTWARE, f.onLost('a')));
});

test('the name is asked again after a loss', async () => {
  const f = fakeDevices();
  await f.devices.lease(f.load, 'webgpu', NO_SOFTWARE, f.onLost('a'));
  f.setName('google swiftshader');
  f.losses[0]?.('gone.');
  await settle();
  await assert.rejects(
    f.devices.lease(f.load, 'webgpu', NO_SOFTWARE, f.onLost('a')),
    /software renderer/,
  );
});
