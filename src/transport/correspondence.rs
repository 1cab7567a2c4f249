//! The correspondence: the map from camera positions to the light plane.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::displacement_grid::{DisplacementGrid, SharedGrid};
use super::geometry::{CameraPixel, Extent, LightPosition};
use super::shard_origin::ShardOrigin;

/// The map from camera positions to the light plane positions behind them: an affine map, and a displacement where the
/// correspondence bends.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// `u = a·(x+½, y+½, 1)` in row 0, `v` likewise in row 1.
    pub affine: [[f64; 3]; 2],
    /// What is added to the affine map.
    pub displacement: Option<SharedGrid>,
    /// Where the picture and its light plane begin, if they are those of a shard.
    pub origin: ShardOrigin,
}

/// A correspondence in JSON, of a whole picture.
#[derive(Serialize, Deserialize)]
struct CorrespondenceFields {
    affine: [[f64; 3]; 2],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    displacement: Option<DisplacementGrid>,
}

impl Serialize for Correspondence {
    /// Fields in JSON; [numbers](Self::to_numbers) in binary formats, which takes less of a WebAssembly module.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            return self.to_numbers().serialize(serializer);
        }
        let fields = CorrespondenceFields {
            affine: self.affine,
            displacement: (self.displacement.as_ref()).map(|grid| DisplacementGrid::clone(grid)),
        };
        fields.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Correspondence {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            let numbers = Vec::deserialize(deserializer)?;
            return Self::from_numbers(&numbers).ok_or_else(|| D::Error::custom("correspondence"));
        }
        let fields = CorrespondenceFields::deserialize(deserializer)?;
        Ok(Self {
            affine: fields.affine,
            displacement: fields.displacement.map(SharedGrid::from),
            origin: ShardOrigin::ZERO,
        })
    }
}

impl Correspondence {
    /// The correspondence that is affine everywhere.
    pub const fn from_affine(affine: [[f64; 3]; 2]) -> Self {
        Self {
            affine,
            displacement: None,
            origin: ShardOrigin::ZERO,
        }
    }

    /// Light plane position behind the centre of a camera pixel.
    pub fn at(&self, pixel: CameraPixel) -> LightPosition {
        self.map(f64::from(pixel.x) + 0.5, f64::from(pixel.y) + 0.5)
    }

    /// Light plane position behind a camera position.
    pub fn map(&self, x: f64, y: f64) -> LightPosition {
        let in_level = self.origin.to_level([x, y]);
        let row = |[a, b, c]: [f64; 3]| a * in_level[0] + b * in_level[1] + c;
        let [u, v] = self.affine.map(row);
        self.origin.to_shard(match &self.displacement {
            None => LightPosition { u, v },
            Some(grid) => {
                let [du, dv] = self.origin.displacement(grid, [x, y]);
                LightPosition {
                    u: u + du,
                    v: v + dv,
                }
            }
        })
    }

    /// The correspondence of a picture that is shifted by camera pixels to the right and down.
    pub fn shifted(&self, [dx, dy]: [i32; 2]) -> Self {
        let row =
            |[x, y, constant]: [f64; 3]| [x, y, constant - x * f64::from(dx) - y * f64::from(dy)];
        let displacement = self.displacement.as_ref();
        Self {
            affine: self.affine.map(row),
            displacement: displacement.map(|grid| SharedGrid::from(grid.shifted([dx, dy]))),
            origin: self.origin,
        }
    }

    /// The correspondence after columns and rows of the light plane have changed places, if it is transposed, and with
    /// positions along the reversed axes, of which 0 counts columns, counted from the other end of the light plane.
    pub fn turned(&self, light: Extent, is_transposed: bool, is_reversed: [bool; 2]) -> Self {
        let mut turned = self.clone();
        if is_transposed {
            turned.affine.swap(0, 1);
        }
        for (row, (reversed, side)) in
            (turned.affine.iter_mut()).zip(is_reversed.into_iter().zip([light.width, light.height]))
        {
            if reversed {
                *row = [-row[0], -row[1], f64::from(side) - row[2]];
            }
        }
        let grid = self.displacement.as_ref();
        turned.displacement =
            grid.map(|grid| SharedGrid::from(grid.turned(is_transposed, is_reversed)));
        turned
    }

    /// Six coefficients of the affine map; and, if the correspondence bends, spacing of the control points, their columns and
    /// rows, step, and codes.
    pub fn to_numbers(&self) -> Vec<f64> {
        let mut numbers = self.affine.as_flattened().to_vec();
        if let Some(grid) = &self.displacement {
            let Extent { width, height } = grid.points();
            numbers.extend([grid.spacing(), width, height].map(f64::from));
            numbers.push(grid.step().into());
            numbers.extend(grid.codes().as_flattened().iter().copied().map(f64::from));
        }
        numbers
    }

    /// The inverse of [`to_numbers`](Self::to_numbers); `None` if the numbers are not those of a correspondence.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[a, b, c, d, e, f], rest) = numbers.split_first_chunk()?;
        let mut correspondence = Self::from_affine([[a, b, c], [d, e, f]]);
        if let Some((&[spacing, width, height, step], codes)) = rest.split_first_chunk() {
            let (pairs, _) = codes.as_chunks();
            let codes = pairs.iter().map(|&[u, v]| [u as i16, v as i16]).collect();
            let points = Extent::new(width as u32, height as u32);
            let grid = DisplacementGrid::new(spacing as u32, step as f32, points, codes).ok()?;
            correspondence.displacement = Some(grid.into());
        }
        Some(correspondence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Extent = Extent::new(40, 20);

    /// An affine map with a displacement that grows with the square of the distance from the picture's top left.
    fn bent() -> Correspondence {
        let points = DisplacementGrid::points_over(CAMERA, 8);
        let code = |(i, j): (u32, u32)| [(10 * i * i) as i16, -((5 * i * j) as i16)];
        let codes = points.cells().map(code).collect();
        let grid = DisplacementGrid::new(8, 1.0 / 64.0, points, codes).unwrap();
        Correspondence {
            affine: [[0.5, 0.1, 3.0], [-0.2, 0.4, 1.0]],
            displacement: Some(grid.into()),
            origin: ShardOrigin::ZERO,
        }
    }

    fn assert_near(a: LightPosition, b: LightPosition, tolerance: f64) {
        let apart = (a.u - b.u).hypot(a.v - b.v);
        assert!(apart <= tolerance, "{a:?} {b:?}");
    }

    #[test]
    fn displacements_are_interpolated_between_control_points() {
        let correspondence = bent();
        let affine = Correspondence::from_affine(correspondence.affine);
        let displacement = |x: f64, y: f64| {
            let (at, from) = (correspondence.map(x, y), affine.map(x, y));
            [at.u - from.u, at.v - from.v]
        };
        let near = |a: [f64; 2], b: [f64; 2]| {
            let apart = (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!(apart < 1e-12, "{a:?} {b:?}");
        };
        near(displacement(8.0, 8.0), [10.0 / 64.0, -5.0 / 64.0]);
        near(displacement(16.0, 8.0), [40.0 / 64.0, -10.0 / 64.0]);
        near(displacement(12.0, 8.0), [25.0 / 64.0, -7.5 / 64.0]);
        near(displacement(12.0, 12.0), [25.0 / 64.0, -11.25 / 64.0]);
        // The border, and beyond it.
        near(displacement(40.0, 0.0), [250.0 / 64.0, 0.0]);
        near(displacement(1e9, -1e9), [250.0 / 64.0, 0.0]);
    }

    #[test]
    fn a_correspondence_follows_the_picture() {
        let before = bent();
        let after = before.shifted([3, 1]);
        let [old, new] = [(10, 10), (13, 11)].map(|(x, y)| CameraPixel { x, y });
        let affine = |map: &Correspondence| Correspondence::from_affine(map.affine);
        assert_near(affine(&before).at(old), affine(&after).at(new), 1e-12);
        // A grid that is shifted by less than its spacing interpolates between other points.
        assert_near(before.at(old), after.at(new), 0.1);
    }

    #[test]
    fn reversals_and_transpositions_turn_the_light_plane() {
        let (map, pixel) = (bent(), CameraPixel { x: 21, y: 7 });
        let LightPosition { u, v } = map.at(pixel);
        let light = Extent::new(32, 16);
        let turned = |transposed, reversed| map.turned(light, transposed, reversed).at(pixel);
        for (transposed, reversed, expected) in [
            (true, [false; 2], [v, u]),
            (false, [true, false], [32.0 - u, v]),
            (false, [false, true], [u, 16.0 - v]),
            (true, [true; 2], [32.0 - v, 16.0 - u]),
        ] {
            let [u, v] = expected;
            assert_near(turned(transposed, reversed), LightPosition { u, v }, 1e-12);
        }
    }

    #[test]
    fn a_correspondence_survives_json_and_binary_formats() {
        for map in [bent(), Correspondence::from_affine(bent().affine)] {
            let json = serde_json::to_string(&map).unwrap();
            assert_eq!(json.contains("displacement"), map.displacement.is_some());
            assert_eq!(serde_json::from_str::<Correspondence>(&json).unwrap(), map);
            assert_eq!(Correspondence::from_numbers(&map.to_numbers()), Some(map));
        }
        let numbers = bent().to_numbers();
        for length in [0, 5, numbers.len() - 2] {
            assert_eq!(Correspondence::from_numbers(&numbers[..length]), None);
        }
    }

    #[test]
    fn grids_of_other_pictures_and_invalid_values_are_refused() {
        let points = DisplacementGrid::points_over(CAMERA, 8);
        assert_eq!(points, Extent::new(6, 4));
        let grid = |spacing, step: f32, points, count| {
            DisplacementGrid::new(spacing, step, points, vec![[0; 2]; count])
        };
        assert!(grid(8, 0.1, points, 24).unwrap().fits(CAMERA));
        assert!(!grid(8, 0.1, points, 24).unwrap().fits(Extent::new(41, 20)));
        for (spacing, step, points, count) in [
            (7, 0.1, points, 24),
            (4097, 0.1, points, 24),
            (8, 0.0, points, 24),
            (8, f32::NAN, points, 24),
            (8, 0.1, points, 23),
            (8, 0.1, Extent::new(1, 24), 24),
        ] {
            assert!(grid(spacing, step, points, count).is_err());
        }
    }
}
