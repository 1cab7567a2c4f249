//! Elementary functions in double precision. WebAssembly modules use the browser's, which makes them smaller.

#[cfg(target_arch = "wasm32")]
pub use js_sys::Math::{cos, pow, sin};

#[cfg(not(target_arch = "wasm32"))]
pub use native::{cos, pow, sin};

#[cfg(not(target_arch = "wasm32"))]
mod native {
    pub fn cos(x: f64) -> f64 {
        x.cos()
    }

    pub fn pow(base: f64, exponent: f64) -> f64 {
        base.powf(exponent)
    }

    pub fn sin(x: f64) -> f64 {
        x.sin()
    }
}
