//! `domecast dataset SPEC`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use super::output::{Failure, Output};
use domecast_dataset::{Dataset, INDEX_NAME, Maker, Shard};
use domecast_design::DesignError;
use domecast_files::{StagedFile, replace_file};
use domecast_sim::SimError;

/// Looks at a folder that others fill too.
const MAX_LOOKS: u32 = 5;

/// Options besides the spec.
#[derive(Debug, clap::Args)]
pub struct DatasetOptions {
    /// Where to write [default: output/<name of the set>]; shards that are there already are left as they are.
    #[arg(long)]
    out: Option<PathBuf>,
    /// In how many shards the set is cut [default: one for each 64 videos].
    #[arg(long)]
    shards: Option<u32>,
    /// Make this shard only, from 0: for many machines, each its own.
    #[arg(long)]
    shard: Option<u32>,
    /// Print the command and the file of each shard, and make nothing.
    #[arg(long)]
    list: bool,
    /// Threads [default: one for each core].
    #[arg(long)]
    threads: Option<usize>,
}

/// Makes the shards that are not there, or lists them.
pub fn run(output: &Output, path: &Path, options: &DatasetOptions) -> Result<(), Failure> {
    output.step("reading the spec");
    let dataset = Dataset::load(path)?;
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("output").join(&dataset.spec().name));
    let count = options.shards.unwrap_or_else(|| dataset.usual_shards());
    let shards = dataset.shards(count)?;
    if options.list {
        output.steps_done();
        return list(output, path, &out, &shards);
    }
    let wanted = match options.shard {
        None => shards.as_slice(),
        Some(index) => shards.get(index as usize..=index as usize).ok_or_else(|| {
            let allowed = format!("0 to {}", count - 1);
            DesignError::at("--shard", index, "there is no such shard", allowed)
        })?,
    };
    fits(&out, &dataset)?;
    let make = || make(output, &dataset, (&shards, wanted), &out);
    let made = match options.threads {
        None => make(),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map_err(|error| Failure::Internal(format!("no threads: {error}")))?.install(make)
        }
    }?;
    output.steps_done();
    let there = shards.iter().filter(|shard| out.join(&shard.file).is_file()).count();
    let videos: u32 = wanted.iter().map(|shard| 2 * shard.pairs).sum();
    output.say(&format!(
        "{}: {made} shards made, {} were there; {there} of {count}, {videos} videos asked for",
        out.display(),
        wanted.len() - made
    ))?;
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "made": made,
        "there": there,
        "shards": count,
        "videos": dataset.spec().videos,
    }))
}

/// The commands, one for each shard.
fn list(output: &Output, path: &Path, out: &Path, shards: &[Shard]) -> Result<(), Failure> {
    let count = shards.len();
    let jobs: Vec<Value> = shards.iter().map(|shard| {
        let file = out.join(&shard.file);
        let index = shard.index;
        json!({
            "command": format!(
                "domecast dataset {} --out {} --shards {count} --shard {index}", path.display(), out.display()
            ),
            "file": file.display().to_string(),
            "videos": 2 * shard.pairs,
            "done": file.is_file(),
        })
    }).collect();
    for job in &jobs {
        let text = |key: &str| job.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
        let done = if job.get("done") == Some(&json!(true)) { "done" } else { "open" };
        output.say(&format!("{done}  {}  {}", text("command"), text("file")))?;
    }
    output.result(&json!({ "ok": true, "jobs": jobs }))
}

/// Refuses a folder that holds something else.
fn fits(out: &Path, dataset: &Dataset) -> Result<(), DesignError> {
    let index = out.join(INDEX_NAME);
    let fault = |problem: &str| {
        let allowed = "a folder that is empty or new, or that of the same spec and version";
        DesignError::at("--out", json!(out.display().to_string()), problem, allowed)
    };
    if index.is_file() {
        let there = domecast_design::parse_json(&domecast_design::read_text(&index)?);
        let hash = there.ok().and_then(|value| Some(value.get("spec_sha256")?.as_str()?.to_owned()));
        return match hash {
            Some(hash) if hash == dataset.hash() => Ok(()),
            _ => Err(fault("it holds the set of another spec, design or version")),
        };
    }
    match std::fs::read_dir(out) {
        // shards that other machines have just begun with have no index yet, and bear the set's name
        Ok(entries) => {
            let name = format!("{}-", dataset.spec().name);
            let foreign = entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned());
            let mut foreign = foreign.filter(|entry| !entry.starts_with(&name) && !entry.starts_with('.'));
            foreign.next().map_or(Ok(()), |entry| Err(fault(&format!("it holds `{entry}`"))))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(fault(&format!("it cannot be read ({error})"))),
    }
}

/// Makes the wanted shards that are not there; how many that were.
fn make(
    output: &Output,
    dataset: &Dataset,
    (shards, wanted): (&[Shard], &[Shard]),
    out: &Path,
) -> Result<usize, Failure> {
    let maker = Maker::new(dataset);
    let open: Vec<&Shard> = wanted.iter().filter(|shard| !out.join(&shard.file).is_file()).collect();
    let all: u32 = open.iter().map(|shard| 2 * shard.pairs).sum();
    let began = Instant::now();
    let mut done = 0;
    for shard in &open {
        let mut staged = StagedFile::new(&out.join(&shard.file), "dataset", &output.rules(&[]))?;
        let bytes = maker.shard(shard, &mut |videos| {
            let now = done + videos;
            let left_s = began.elapsed().as_secs_f64() * f64::from(all - now) / f64::from(now.max(1));
            output.step(&format!("{now} of {all} videos, {} left", time(left_s)));
        });
        staged.write(&bytes.map_err(failure)?)?;
        output.kept(staged.commit()?);
        done += 2 * shard.pairs;
        write_index(dataset, shards, out)?;
    }
    if open.is_empty() {
        write_index(dataset, shards, out)?;
    }
    Ok(open.len())
}

fn write_index(dataset: &Dataset, shards: &[Shard], out: &Path) -> Result<(), Failure> {
    // another machine may finish a shard between look and write: then once more
    let there = || shards.iter().filter(|shard| out.join(&shard.file).is_file()).count();
    for _ in 0..MAX_LOOKS {
        let before = there();
        let index = dataset.index(shards, out)?;
        replace_file(&out.join(INDEX_NAME), format!("{index:#}\n").as_bytes())?;
        if there() == before {
            break;
        }
    }
    Ok(())
}

fn failure(error: SimError) -> Failure {
    match error {
        SimError::Input(error) => Failure::Input(error),
        other => DesignError::at("", "", other.to_string(), "touches that the sensor carries").into(),
    }
}

/// A time for people.
fn time(seconds: f64) -> String {
    match seconds {
        s if s >= 5400.0 => format!("{:.1} h", s / 3600.0),
        s if s >= 90.0 => format!("{:.0} min", s / 60.0),
        s => format!("{s:.0} s"),
    }
}
