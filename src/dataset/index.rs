//! `dataset.json`: what a set is, and which of its shards are there.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::check::{Dataset, sha256_hex};
use crate::make::Shard;
use crate::spec::Split;
use domecast_design::DesignError;
use domecast_design::layout::Layout;
use domecast_hardness::COLUMNS;

/// Name of the file.
pub const INDEX_NAME: &str = "dataset.json";
/// What the file says that it is.
pub const FORMAT: &str = "domecast-dataset";

/// SHA-256 of a file, hexadecimal, and its length; `None` where there is none.
fn file_hash(path: &Path) -> Option<(String, u64)> {
    let mut file = std::fs::File::open(path).ok()?;
    let mut digest = Sha256::new();
    let bytes = std::io::copy(&mut file, &mut HashWriter(&mut digest)).ok()?;
    Some((digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect(), bytes))
}

struct HashWriter<'a>(&'a mut Sha256);

impl std::io::Write for HashWriter<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Hashes and lengths that an earlier index has.
fn known(path: &Path) -> BTreeMap<String, (String, u64)> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let index: Value = serde_json::from_str(&text).unwrap_or_default();
    let shards = index.get("shards").and_then(Value::as_array).into_iter().flatten();
    let entry = |shard: &Value| {
        let text = |key: &str| Some(shard.get(key)?.as_str()?.to_owned());
        Some((text("file")?, (text("sha256")?, shard.get("bytes")?.as_u64()?)))
    };
    shards.filter_map(entry).collect()
}

impl Dataset {
    /// The index of the set as it stands in a folder.
    ///
    /// # Errors
    /// A design whose dots cannot be laid out.
    pub fn index(&self, shards: &[Shard], folder: &Path) -> Result<Value, DesignError> {
        let spec = &self.spec;
        let layout = Layout::of_design(&self.design)?;
        let (mut splits, mut balance) = (BTreeMap::new(), BTreeMap::new());
        for pair in 0..self.pairs() {
            *splits.entry(self.split_of_sensor(self.sensor_of(pair)).as_str()).or_insert(0) += 2;
        }
        if let Some(classes) = &spec.hardness.classes {
            for split in Split::ALL {
                let each = splits.get(split.as_str()).copied().unwrap_or(0) / 2;
                let of: BTreeMap<&str, i32> =
                    classes.iter().map(|class| (class.name.as_str(), each)).collect();
                balance.insert(split.as_str(), of);
            }
        }
        let known = known(&folder.join(INDEX_NAME));
        let entry = |shard: &Shard| {
            let path = folder.join(&shard.file);
            let bytes = std::fs::metadata(&path).map(|about| about.len()).ok();
            // a shard's name says what is in it: one that is hashed is not read again
            let hashed = known.get(&shard.file).filter(|(_, length)| Some(*length) == bytes).cloned();
            let there = hashed.or_else(|| file_hash(&path));
            json!({
                "file": shard.file,
                "index": shard.index,
                "first": 2 * shard.first,
                "count": 2 * shard.pairs,
                "sha256": there.as_ref().map(|(hash, _)| hash),
                "bytes": there.map(|(_, bytes)| bytes),
            })
        };
        let (camera, elastomer) = (&self.design.sections().camera, &self.design.sections().elastomer);
        Ok(json!({
            "format": FORMAT,
            "version": 1,
            "name": spec.name,
            "domecast": env!("CARGO_PKG_VERSION"),
            "spec": spec,
            "spec_sha256": self.hash,
            "design": self.design.name(),
            "design_sha256": sha256_hex(&[self.design.text().as_bytes()]),
            "seed": spec.seed,
            "videos": spec.videos,
            "frames": spec.frames.count,
            "width": spec.frames.width,
            "height": spec.frames.height,
            "camera": { "full_width": camera.width, "full_height": camera.height, "scale": self.scale() },
            "dots": {
                "count": layout.dots.len(),
                "image_px": layout.dots.iter().map(|dot| dot.image_px.to_array()).collect::<Vec<_>>(),
                "surface_mm": layout.dots.iter().map(|dot| dot.surface_mm.to_array()).collect::<Vec<_>>(),
            },
            "readings": { "kind": spec.readings.kind, "columns": COLUMNS },
            "classes": spec.hardness.classes.as_ref().map(|c| c.each_ref().map(|class| class.name.as_str())),
            "label_range_mpa": spec.hardness.young_mpa,
            "dome": {
                "radius_mm": self.design.sections().dome.radius_mm,
                "center_z_mm": self.design.sections().dome.shape().center_mm().z,
                "youngs_modulus_mpa": elastomer.young_modulus_mpa,
                "poisson": elastomer.poisson_ratio,
                "reference_mm": reference_mm(&self.design)?,
            },
            "splits": splits,
            "balance": balance,
            "shards": shards.iter().map(entry).collect::<Vec<_>>(),
        }))
    }
}

/// The point that wrenches and displacements are about: that of the springs, or the origin.
fn reference_mm(design: &domecast_design::Design) -> Result<[f64; 3], DesignError> {
    if design.is_rigid() {
        return Ok([0.0; 3]);
    }
    Ok(domecast_design::suspension_of(design)?.at_mm().to_array())
}
