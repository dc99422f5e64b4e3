//! The lights and what stands between them and the membrane: what shape from colour is read with.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

use domecast_light::cavity::{Cavities, Convex};
use domecast_light::direct::Emitter;
use domecast_light::lobe::{Diffuser, Lobe};
use domecast_light::tables::{Source, Ways};
use domecast_optics::{ColorChannel, SensorOptics};

/// The light of the sensor. Levels are parts of full scale, linear in light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LightConstants {
    /// The lights; a white one stands here once for each colour.
    pub leds: Vec<LedConstants>,
    /// What each channel of the camera (row) takes of each colour of light (column), of what it takes of its own.
    pub crosstalk: [[f64; 3]; 3],
    /// Share of the light that the membrane gives back, for each channel.
    pub reflectance: [f64; 3],
    /// The same with the dots' share of the dome: what the dome lights itself with.
    pub mean_reflectance: [f64; 3],
    /// Level that light from outside adds.
    pub stray: f64,
    /// Exponent of the camera's code: level = light^(1/gamma).
    #[serde(default = "one")]
    pub gamma: f64,
    /// Share of the light that gets through the platform where it stands in the way.
    #[serde(default)]
    pub through_platform: f64,
    /// Sides of the sheet, mm.
    pub sheet_mm: [f64; 2],
    /// What the platform leaves open to the light: a ray is free where these together cover it.
    pub hollows: Vec<HollowConstants>,
    /// `nominal` (the design's) or `measured`.
    pub source: String,
    /// How far the built light may be off these numbers: the priors of `calibrate-light`.
    #[serde(default)]
    pub tolerances: LightTolerances,
    /// Standard deviation of each measured number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sd: Option<LightDeviations>,
    /// Names of the measured numbers and their covariance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<LightUncertainty>,
}

/// How far lights as they are bought and put in may be off, each as one standard deviation.
///
/// All are choices: fluxes of a bin of lights scatter by some 10 to 20 %, hand-soldered boards by 0.2 mm, and of tapes nothing
/// is known but their looks. A bench that knows better writes its own numbers into the constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct LightTolerances {
    /// Flux of each light, part of it.
    pub flux_part: f64,
    /// Place of each light on each axis, mm.
    pub place_mm: f64,
    /// Direction of each light about each of two axes, rad.
    pub axis_rad: f64,
    /// Share of a diffuser that leaves by Lambert's law.
    pub lambert_fraction: f64,
    /// Width of a diffuser's lobe, or the exponent of a bare light's, part of it.
    pub lobe_part: f64,
    /// Reflectance of the membrane in each channel, part of it.
    pub reflectance_part: f64,
    /// Each number of the crosstalk beside the diagonal.
    pub crosstalk: f64,
    /// Level of stray light, full scale 1.
    pub stray: f64,
}

impl Default for LightTolerances {
    fn default() -> Self {
        Self {
            flux_part: 0.2,
            place_mm: 0.2,
            axis_rad: 0.04,
            lambert_fraction: 0.15,
            lobe_part: 0.15,
            reflectance_part: 0.1,
            crosstalk: 0.02,
            stray: 0.004,
        }
    }
}

/// Standard deviations of a measured light's numbers, in the units of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LightDeviations {
    /// Of each light.
    pub leds: Vec<LedDeviations>,
    /// Of the crosstalk; its diagonal is 1 by definition.
    pub crosstalk: [[f64; 3]; 3],
    /// Of the membrane's reflectance.
    pub reflectance: [f64; 3],
    /// Of the level of stray light.
    pub stray: f64,
}

/// Standard deviations of a light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LedDeviations {
    /// On each axis of the sensor frame, mm.
    pub position_mm: [f64; 3],
    /// Angle on each of two axes across its own, rad.
    pub axis_rad: [f64; 2],
    /// Radiant flux, mW.
    pub flux: f64,
    /// Of the lobe.
    pub lobe: LobeDeviations,
}

/// Standard deviations of a lobe; 0 of a number that it does not have or that was not fitted.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LobeDeviations {
    /// Of the bare light's exponent.
    pub exponent: f64,
    /// Of the share that leaves by Lambert's law.
    pub lambert_fraction: f64,
    /// Of the width of the Gaussian lobe, rad.
    pub lobe_width_rad: f64,
}

/// What `calibrate-light` left open.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LightUncertainty {
    /// Names, as the command prints them.
    pub parameters: Vec<String>,
    /// Their covariance.
    pub covariance: Vec<Vec<f64>>,
}

/// A light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LedConstants {
    /// `red`, `green` or `blue`.
    pub color: String,
    /// Centre of the square that shines, sensor frame, mm.
    pub position_mm: [f64; 3],
    /// Unit direction that it faces.
    pub axis: [f64; 3],
    /// Unit direction of one of its sides.
    pub across: [f64; 3],
    /// Length of its sides, mm.
    pub side_mm: f64,
    /// Radiant flux of the bare light, mW.
    pub flux: f64,
    /// How it sends that into directions.
    pub lobe: LobeConstants,
}

/// Intensity by direction: `cos^exponent` of the angle to the axis, and a diffuser over it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LobeConstants {
    /// Exponent of the bare light; 1 is Lambert's law.
    pub exponent: f64,
    /// The diffuser, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diffuser: Option<DiffuserConstants>,
}

/// A diffuser over a light.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct DiffuserConstants {
    /// Share of what it lets through that leaves by Lambert's law.
    pub lambert_fraction: f64,
    /// Standard deviation of the Gaussian lobe of the rest, rad.
    pub lobe_width_rad: f64,
    /// Share of the light that it lets through.
    pub transmittance: f64,
}

/// A convex hollow of the platform.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HollowConstants {
    /// What it is in its own frame.
    pub shape: Convex,
    /// From the sensor frame to its own: the rows of a 3x4.
    pub own_from_sensor: [[f64; 4]; 3],
}

fn one() -> f64 {
    1.0
}

impl HollowConstants {
    /// A hollow and `own_from_sensor`.
    pub fn new(shape: Convex, own_from_sensor: &DAffine3) -> Self {
        let rows = own_from_sensor.matrix3.transpose();
        let [x, y, z] = [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.to_array());
        let at = own_from_sensor.translation;
        let row = |[a, b, c]: [f64; 3], d: f64| [a, b, c, d];
        Self { shape, own_from_sensor: [row(x, at.x), row(y, at.y), row(z, at.z)] }
    }

    fn own(&self) -> DAffine3 {
        let row = |[a, b, c, _]: [f64; 4]| DVec3::new(a, b, c);
        let [x, y, z] = self.own_from_sensor;
        let matrix = DMat3::from_cols(row(x), row(y), row(z)).transpose();
        DAffine3::from_mat3_translation(matrix, DVec3::new(x[3], y[3], z[3]))
    }
}

impl LobeConstants {
    fn lobe(&self) -> Lobe {
        let bare = Lobe::cosine_power(self.exponent);
        match self.diffuser {
            None => bare,
            Some(tape) => bare.behind(&Diffuser {
                lambert_fraction: tape.lambert_fraction,
                lobe_width_rad: tape.lobe_width_rad,
                transmittance: tape.transmittance,
            }),
        }
    }
}

impl LightConstants {
    /// What stands between the lights and the membrane of a sensor.
    ///
    /// # Errors
    /// A sentence that names the field at fault.
    pub fn ways(&self, optics: &SensorOptics) -> Result<Ways, String> {
        let numbers =
            self.crosstalk.as_flattened().iter().chain(&self.reflectance).chain(&self.mean_reflectance);
        let shares = [self.stray, self.through_platform];
        if !numbers.chain(&shares).all(|v| (0.0..=10.0).contains(v))
            || !self.mean_reflectance.iter().all(|r| *r < 1.0)
        {
            return Err("light: has shares of light below 0, or a mean_reflectance of 1 and more".into());
        }
        if !(0.2..=5.0).contains(&self.gamma) {
            return Err(format!("light.gamma: is {}; 0.2 to 5 is allowed", self.gamma));
        }
        self.ways_beside(optics, None)
    }

    /// The same beside another light, whose lobes need not be computed again where they are alike; shares may be a little below 0,
    /// as in a fit on its way.
    pub(crate) fn ways_beside(
        &self,
        optics: &SensorOptics,
        other: Option<(&Self, &Ways)>,
    ) -> Result<Ways, String> {
        let known = |(light, ways): (&Self, &Ways)| -> Vec<(LobeConstants, Lobe)> {
            let both = light.leds.iter().zip(&ways.sources);
            both.map(|(led, source)| (led.lobe, source.emitter.lobe.clone())).collect()
        };
        let mut lobes = other.map_or_else(Vec::new, known);
        let mut sources = Vec::new();
        for (i, led) in self.leds.iter().enumerate() {
            let lobe = match lobes.iter().find(|(of, _)| *of == led.lobe) {
                Some((_, lobe)) => lobe.clone(),
                None => {
                    let lobe = led.lobe.lobe();
                    lobes.push((led.lobe, lobe.clone()));
                    lobe
                }
            };
            sources.push(self.source(i, led, lobe, optics)?);
        }
        let hollows = self.hollows.iter().map(|hollow| (hollow.shape.clone(), hollow.own()));
        Ok(Ways {
            sources,
            optics: ColorChannel::ALL.map(|channel| optics.for_channel(channel)),
            cavities: Some(Cavities::new(hollows)),
            through_platform: self.through_platform,
            sheet_half_mm: 0.5 * DVec2::from_array(self.sheet_mm),
            fresnel: true,
        })
    }

    fn source(
        &self,
        i: usize,
        led: &LedConstants,
        lobe: Lobe,
        optics: &SensorOptics,
    ) -> Result<Source, String> {
        let colors = ["red", "green", "blue"];
        let color = colors
            .iter()
            .position(|name| *name == led.color)
            .ok_or_else(|| format!("light.leds[{i}].color: \"{}\" is none of red, green, blue", led.color))?;
        let (axis, across) = (DVec3::from_array(led.axis), DVec3::from_array(led.across));
        let is_frame = (axis.length() - 1.0).abs() < 1e-3
            && (across.length() - 1.0).abs() < 1e-3
            && axis.dot(across).abs() < 1e-3;
        if !(is_frame && DVec3::from_array(led.position_mm).is_finite()) {
            return Err(format!(
                "light.leds[{i}]: needs a place, and unit vectors `axis` and `across` at right angles"
            ));
        }
        if !(led.flux >= 0.0 && led.flux.is_finite() && led.side_mm > 0.0 && led.lobe.exponent >= 0.0) {
            return Err(format!("light.leds[{i}]: needs a flux of 0 or more and a side above 0"));
        }
        let across = (across - axis * axis.dot(across)).normalize();
        let turned = DMat3::from_cols(across, axis.cross(across), axis);
        Ok(Source {
            emitter: Emitter {
                platform_from_emitter: DAffine3::from_mat3_translation(
                    turned,
                    DVec3::from_array(led.position_mm),
                ),
                half_side_mm: 0.5 * led.side_mm,
                flux_mw: 1.0,
                lobe,
            },
            optics: optics.for_channel(ColorChannel::ALL[color]),
            seen_mw: self.crosstalk.map(|row| row[color] * led.flux),
        })
    }
}
