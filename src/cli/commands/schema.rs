//! `domecast schema`

use super::output::{Failure, Output};

/// Prints the JSON schema of the design file, of the scene file, or of the spec of a data set.
pub fn run(output: &Output, scene: bool, dataset: bool) -> Result<(), Failure> {
    if dataset {
        let schema = domecast_design::schema_of::<domecast_dataset::spec::DatasetSpec>();
        return output.answer(&format!("{schema:#}\n"));
    }
    if scene {
        let schema = domecast_design::schema_of::<domecast_sim::scene::SceneFile>();
        return output.answer(&format!("{schema:#}\n"));
    }
    output.answer(&format!("{:#}\n", domecast_design::design_schema()))
}
