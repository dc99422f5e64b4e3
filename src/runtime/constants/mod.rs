//! What the runtime needs to know of one sensor: the form of `constants.json`, and the sensor that it describes.
//!
//! ```
//! use domecast_runtime::constants::Constants;
//!
//! let fault = "{}".parse::<Constants>().unwrap_err();
//! assert!(fault.to_string().starts_with("is not a constants file"));
//! ```

use std::io::Read as _;
use std::path::Path;
use std::str::FromStr;

mod error;
mod law;
mod light;
mod loads;
mod model;
mod moving;
mod plain;
mod plain_input;
mod plain_pnp;
mod refit;
mod sensor;
mod stiffness;
mod uncertainty;

pub use error::ConstantsError;
pub use law::{MagnetLaw, SpringLaw, SpringLawEnds};
pub use light::{
    DiffuserConstants, HollowConstants, LedConstants, LedDeviations, LightConstants, LightDeviations,
    LightTolerances, LightUncertainty, LobeConstants, LobeDeviations,
};
pub use loads::{PosedLoad, loads_over};
pub use model::{
    BlackDot, CalibrationPriors, CameraConstants, Constants, ElastomerConstants, FORMAT, KeyConstants,
    KeyImageConstants, LayerConstants, MaskConstants, Matrix4, OpticsConstants, PlainRuntime,
    SpringConstants, StiffnessAt, VERSION, WhiteMarker,
};
pub use moving::MovingMass;
pub use plain::{Bias, PlainFit};
pub use plain_input::{PlainError, PlainInput};
pub use plain_pnp::PlainRuntimeSolver;
pub use stiffness::{matrix_of, rows, stiffness_between, wrench_by_table};
pub use uncertainty::{
    AxisUncertainty, OpticsUncertainty, SpringTemperature, SpringTolerances, SpringUncertainty,
};
pub(crate) use uncertainty::{body_numbers, shift_body, shift_lens};

/// Bytes at most that are read of a file.
const MAX_FILE_BYTES: u64 = 1 << 24;
/// Names of the six axes of a displacement.
pub const POSE_AXES: [&str; 6] = ["tx", "ty", "tz", "rx", "ry", "rz"];
/// Names of the six axes of a wrench.
pub const WRENCH_AXES: [&str; 6] = ["Fx", "Fy", "Fz", "Mx", "My", "Mz"];

impl Constants {
    /// The file's text.
    pub fn to_json(&self) -> String {
        // numbers, strings and lists only: nothing here can fail to be written
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// JSON schema of the file, for those who read it with other programs.
    #[cfg(feature = "schema")]
    pub fn schema() -> String {
        let schema = schemars::schema_for!(Constants);
        let mut text = serde_json::to_string_pretty(&schema).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads a constants file.
    ///
    /// # Errors
    /// [`ConstantsError`]: the file cannot be read, or is of another form or version.
    pub fn load(path: &Path) -> Result<Self, ConstantsError> {
        let fault = |problem: String| ConstantsError { file: None, problem }.in_file(path);
        let mut text = String::new();
        // a device may have no end
        std::fs::File::open(path)
            .and_then(|file| file.take(MAX_FILE_BYTES).read_to_string(&mut text))
            .map_err(|error| fault(format!("cannot be read: {error}")))?;
        text.parse().map_err(|error: ConstantsError| error.in_file(path))
    }
}

impl FromStr for Constants {
    type Err = ConstantsError;

    /// Reads the text of a constants file.
    fn from_str(text: &str) -> Result<Self, ConstantsError> {
        let fault = |problem| ConstantsError { file: None, problem };
        let constants: Self = serde_json::from_str(text.strip_prefix('\u{feff}').unwrap_or(text))
            .map_err(|error| fault(format!("is not a constants file: {error}")))?;
        if constants.format != FORMAT || constants.version != VERSION {
            return Err(fault(format!(
                "has format \"{}\" version {}; this release reads \"{FORMAT}\" version {VERSION}",
                constants.format, constants.version
            )));
        }
        Ok(constants)
    }
}
