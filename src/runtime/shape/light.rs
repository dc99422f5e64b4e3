//! The light of the constants, ready to be asked at every cell.

use glam::{Vec3A, Vec4};

use super::error::ShapeError;
use crate::constants::{Constants, LightConstants};
pub(crate) use domecast_light::field::BeforeNormal as PointLight;
use domecast_light::field::{FieldParts, LightField};
use domecast_light::fresnel;
use domecast_light::tables::{Prepared, Ways};
use domecast_optics::{ColorChannel, SensorOptics};

/// Places of the table of what leaves towards the camera.
const LEAVING: usize = 512;

/// What a build of this release writes.
const REBUILD: &str = "build the design again with this release, which writes its nominal light";

/// Makes the tables of lights.
pub(super) type Prepare<'a> = &'a dyn Fn(&Ways, &FieldParts) -> Prepared;

fn parts(light: &LightConstants) -> FieldParts {
    FieldParts { falloff: true, albedo: Some(light.mean_reflectance), moved: true }
}

/// Irradiance of the membrane, and what of it goes the camera's way.
#[derive(Debug, Clone)]
pub(crate) struct ShapeLight {
    field: LightField,
    /// By the squared sine of a way in the dome, times the channel's reflectance.
    leaving: Vec<Vec3A>,
    leaving_scale: f32,
    /// Level that light from outside adds.
    pub stray: f32,
    /// Light of a byte's value, full scale 1.
    pub linear: Vec<f32>,
}

impl ShapeLight {
    /// With the lights' ways to the membrane.
    pub fn new(
        constants: &Constants,
        optics: &SensorOptics,
        prepare: Prepare<'_>,
    ) -> Result<(Self, Ways), ShapeError> {
        let Some(light) = &constants.light else {
            return Err(ShapeError::new("light", "is not in these constants", REBUILD));
        };
        if light.leds.is_empty() {
            return Err(ShapeError::new("light.leds", "is empty: the sensor has no lights", REBUILD));
        }
        let ways = light.ways(optics).map_err(|problem| ShapeError::new("light", problem, REBUILD))?;
        for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
            if !ways.sources.iter().any(|source| source.seen_mw[channel] > 0.0) {
                let problem = format!("gives the {name} channel nothing: three colours are needed");
                return Err(ShapeError::new("light.leds", problem, "give each colour a light"));
            }
        }
        let prepared = prepare(&ways, &parts(light));
        Ok((Self::with(light, optics, &ways, &prepared), ways))
    }

    /// The same with tables of these ways that the caller has.
    pub fn with(light: &LightConstants, optics: &SensorOptics, ways: &Ways, prepared: &Prepared) -> Self {
        let field = LightField::new(ways, prepared, &parts(light));
        let index = |channel: ColorChannel| {
            let last = optics.layers().last();
            last.map_or(1.0, |layer| layer.index_for(channel))
        };
        let indices = ColorChannel::ALL.map(index);
        let max_sine_squared = 1.0 / indices.iter().fold(1.0_f64, |max, n| max.max(n * n));
        let at = |i: usize| {
            let sine = (i as f64 / LEAVING as f64 * max_sine_squared).sqrt();
            let passed = |c: usize| {
                let layers: Vec<f64> =
                    optics.layers().iter().map(|layer| layer.index_for(ColorChannel::ALL[c])).collect();
                let momentum = (sine * indices[c]).min(1.0);
                light.reflectance[c] / (indices[c] * indices[c]) * fresnel::through(&layers, momentum)
            };
            Vec3A::new(passed(0) as f32, passed(1) as f32, passed(2) as f32)
        };
        let linear = |code: usize| (code as f64 / 255.0).powf(light.gamma) as f32;
        Self {
            field,
            leaving: (0..=LEAVING + 1).map(at).collect(),
            leaving_scale: (LEAVING as f64 / max_sine_squared) as f32,
            stray: light.stray as f32,
            linear: (0..256).map(linear).collect(),
        }
    }

    /// Share of the irradiance that goes the camera's way, for a direction in the dome with this component along the axis.
    #[inline]
    pub fn passed(&self, cosine: f32) -> Vec3A {
        let at = ((1.0 - cosine * cosine) * self.leaving_scale).clamp(0.0, LEAVING as f32);
        let i = at as usize;
        match self.leaving.get(i..i + 2) {
            Some([low, high]) => *low + (*high - *low) * (at - i as f32),
            _ => Vec3A::ZERO,
        }
    }

    /// Irradiance of an undeformed place: a direction from the sphere's centre ([`domecast_light::dome_map::DomeFace`]).
    #[inline]
    pub fn still(&self, place: Vec3A) -> Vec3A {
        let light: Vec4 = self.field.still(place);
        Vec3A::from_vec4(light)
    }

    /// The light on a point of the skin, sensor frame.
    #[inline]
    pub fn at(&self, point_mm: Vec3A) -> PointLight {
        self.field.before_normal(point_mm).unwrap_or_default()
    }
}
