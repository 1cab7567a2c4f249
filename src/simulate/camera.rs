//! The camera: from measurements to electrons with noise, to 16-bit codes.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Poisson, StandardNormal};

use crate::transport::CHANNELS;

/// A camera with linear 16-bit codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Electrons of the measurement 1.
    pub electrons: f64,
}

/// One of a capture's independent random sequences. A seed and a stream determine its numbers, whatever
/// other streams are used and in whatever order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RandomStreamId {
    /// The elements of the pattern with this index.
    Pattern(u32),
    /// The noise of the photograph with this index.
    Photograph(u32),
    /// The faults of a session.
    Fault,
}

impl RandomStreamId {
    /// Starts the sequence.
    pub fn start(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(match self {
            Self::Pattern(i) => u64::from(i) << 1,
            Self::Photograph(i) => u64::from(i) << 1 | 1,
            Self::Fault => u64::MAX,
        });
        rng
    }
}

impl Camera {
    /// Code of the measurement 0.
    pub const BLACK: f64 = 512.0;
    /// Code of the measurement 1.
    pub const WHITE: f64 = 60_000.0;
    /// Standard deviation of the read noise, in electrons.
    const READ_NOISE: f64 = 8.0;

    /// Photographs `picture`, in units of the measurement, with shot noise (Poisson) and read noise (Gaussian).
    /// Returns codes; too much light saturates.
    pub fn photograph(
        self,
        picture: &[[f32; CHANNELS]],
        noise: &mut ChaCha8Rng,
    ) -> Vec<[u16; CHANNELS]> {
        let code_per_electron = (Self::WHITE - Self::BLACK) / self.electrons;
        let mut code = |measurement: f32| {
            let mean = f64::from(measurement) * self.electrons;
            // `new` refuses a mean of zero, with which no electron arrives.
            let photoelectrons = Poisson::new(mean).map_or(0.0, |p| p.sample(noise));
            let read: f64 = StandardNormal.sample(noise);
            let electrons = photoelectrons + Self::READ_NOISE * read;
            (Self::BLACK + electrons * code_per_electron).round() as u16 // `as` saturates
        };
        picture.iter().map(|pixel| pixel.map(&mut code)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera {
        electrons: 40_000.0,
    };

    #[test]
    fn noise_has_the_mean_and_variance_of_shot_and_read_noise() {
        for measurement in [0.0f32, 0.0001, 0.02, 0.7] {
            let mut rng = RandomStreamId::Photograph(3).start(1);
            let codes = CAMERA.photograph(&[[measurement; 3]; 40_000], &mut rng);
            let gain = (60000.0 - 512.0) / 40000.0;
            let electrons: Vec<f64> = codes
                .iter()
                .flatten()
                .map(|c| (f64::from(*c) - 512.0) / gain)
                .collect();
            let n = electrons.len() as f64;
            let mean = electrons.iter().sum::<f64>() / n;
            let variance = electrons.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n;
            let expected = f64::from(measurement) * 40000.0;
            let sigma = ((expected + 64.0) / n).sqrt();
            assert!(
                (mean - expected).abs() < 5.0 * sigma,
                "{measurement}: mean {mean}"
            );
            let ratio = variance / (expected + 64.0);
            assert!(
                (0.97..1.03).contains(&ratio),
                "{measurement}: variance x{ratio}"
            );
        }
    }

    #[test]
    fn streams_differ_and_repeat() {
        let draw = |stream: RandomStreamId, seed| {
            let mut rng = stream.start(seed);
            CAMERA.photograph(&[[0.5; 3]; 8], &mut rng)
        };
        let first = draw(RandomStreamId::Photograph(0), 1);
        assert_eq!(first, draw(RandomStreamId::Photograph(0), 1));
        assert_ne!(first, draw(RandomStreamId::Photograph(1), 1));
        assert_ne!(first, draw(RandomStreamId::Pattern(0), 1));
        assert_ne!(first, draw(RandomStreamId::Photograph(0), 2));
    }

    #[test]
    fn too_much_light_saturates() {
        let mut rng = RandomStreamId::Photograph(0).start(1);
        let codes = CAMERA.photograph(&[[9.0; 3]], &mut rng);
        assert_eq!(codes, [[u16::MAX; 3]]);
    }
}
