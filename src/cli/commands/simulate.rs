//! `domecast simulate SCENE`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::output::{Failure, Output};
use domecast_design::DesignError;
use domecast_files::StagedFolder;
use domecast_sim::electronics::deviation::{CodingDeviation, CodingFigures};
use domecast_sim::run;
use domecast_sim::run::{ContactFault, RunError, Summary};
use domecast_sim::{Plan, Scene, SimError};

/// Options besides the scene.
#[derive(Debug, clap::Args)]
pub struct SimulateOptions {
    /// Where to write [default: output/<scene name>].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Print the plan of effects and draw nothing.
    #[arg(long)]
    explain: bool,
    /// Use every effect that the scene calls for, whatever its tolerance.
    #[arg(long)]
    everything: bool,
    /// Number of frames, instead of the scene's: spread over the same time.
    #[arg(long)]
    frames: Option<u32>,
    /// Write what each pixel sees as well: `frame_NNNN.surface.npy`, `.normal.npy`, `.displacement.npy`, `.pressure.npy`,
    /// `.traction.npy` and `depth/frame_NNNN.png`.
    #[arg(long)]
    depth: bool,
    /// Threads that draw [default: one for each core].
    #[arg(long)]
    threads: Option<usize>,
    /// Seed of everything random, instead of the scene's.
    #[arg(long)]
    seed: Option<u64>,
    /// Compute all tables of the light and the elastomer anew, and keep none. They are kept in the folder DOMECAST_CACHE,
    /// else in `domecast` in XDG_CACHE_HOME or ~/.cache (at most 0.5 GB); frames are the same bytes.
    #[arg(long)]
    no_cache: bool,
}

/// Plans, renders, and prints what was left out.
pub fn run(output: &Output, path: &Path, options: &SimulateOptions) -> Result<(), Failure> {
    let began = Instant::now();
    output.step("reading the scene");
    let in_file = |error: SimError| match error {
        SimError::Input(error) if error.file.is_none() => Failure::from(error.in_file(path)),
        SimError::Input(error) => Failure::Input(error),
        other => {
            DesignError::at("", "", other.to_string(), "a load that the springs carry").in_file(path).into()
        }
    };
    let mut scene = Scene::load(path).map_err(in_file)?;
    scene.override_run(options.frames, options.seed).map_err(in_file)?;
    if options.depth {
        scene.write_depth();
    }
    scene.set_cache((!options.no_cache).then(|| output.cache()).flatten());
    let out = options.out.clone().unwrap_or_else(|| PathBuf::from("output").join(scene.name()));
    // the plan may take a while: a place that is refused is refused before it
    let staged = match options.explain {
        true => None,
        false => Some(StagedFolder::new(&out, "simulate", &output.rules(&[path, scene.folder()]))?),
    };
    output.step("planning the effects");
    let plan =
        if options.everything { Plan::everything(&scene) } else { Plan::of(&scene) }.map_err(in_file)?;
    let Some(staged) = staged else {
        output.steps_done();
        let unit_s = unit_s(&scene);
        explain(output, &scene, &plan, unit_s)?;
        let seconds = seconds(&scene, &plan, unit_s);
        return output
            .result(&json!({ "ok": true, "scene": scene.name(), "plan": plan, "seconds": seconds }));
    };
    let count = scene.frame_count();
    let draw = || {
        run::fill(&scene, &plan, &staged, &mut |done| {
            output.step(&format!("{} frame {done} of {count}", bar(done, count)))
        })
    };
    let drawn = match options.threads {
        None => draw(),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map_err(|error| Failure::Internal(format!("no threads: {error}")))?.install(draw)
        }
    };
    output.steps_done();
    let summary = drawn.map_err(|error| match error {
        RunError::Scene(error) => in_file(error),
        RunError::Write(error) => Failure::Write(error),
    })?;
    output.kept(staged.commit()?);
    tell(output, &scene, &plan, &summary)?;
    let seconds = began.elapsed().as_secs_f64();
    output.say(&format!("{}: {} frames in {seconds:.2} s", out.display(), summary.frames))?;
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "frames": summary.frames,
        "notes": summary.notes,
        "contact": summary.contact,
        "worst_contact": summary.worst_contact.map(|worst| json!({
            "frame": worst.frame,
            "px": worst.error.px,
            "force_n": worst.error.force_n,
        })),
        "coding": summary.coding.as_ref().map(CodingDeviation::figures),
        "work": summary.work.total(),
        "plan": plan,
    }))
}

/// Prints what is not as asked, the plan, and what a lossy code did.
fn tell(output: &Output, scene: &Scene, plan: &Plan, summary: &Summary) -> Result<(), Failure> {
    let count = scene.frame_count();
    for (frame, note) in &summary.notes {
        output.warn(&format!("frame {frame}: {note}"));
    }
    for fault in &summary.contact {
        let ContactFault { status, frames, first, note } = fault;
        output
            .warn(&format!("contact {status} in {frames} of {count} frames, first in frame {first}: {note}"));
    }
    explain(output, scene, plan, unit_s(scene))?;
    let coding = summary.coding.as_ref().map(CodingDeviation::figures);
    if let Some(CodingFigures { max_grey, p999_grey, rms_grey }) = coding {
        output.say(&format!(
            "  the camera's JPEG changes 999 of 1000 values by at most {p999_grey} grey levels, any by at most {max_grey}, \
             {rms_grey:.1} rms; the tolerance holds before it"
        ))?;
    }
    Ok(())
}

/// How long the probe is run, s.
const PROBE_S: f64 = 0.01;

/// Time of a unit of counted work on this machine now, on one core, s: the shortest of short runs of the simulator's probe. It is
/// printed, and nothing is chosen by it.
fn unit_s(scene: &Scene) -> f64 {
    let began = Instant::now();
    let mut shortest = f64::INFINITY;
    while began.elapsed().as_secs_f64() < PROBE_S {
        let start = Instant::now();
        let units = domecast_sim::probe(scene);
        shortest = shortest.min(start.elapsed().as_secs_f64() / units as f64);
    }
    shortest
}

/// About what each effect that the scene calls for takes on one core of this machine, s.
fn seconds(scene: &Scene, plan: &Plan, unit_s: f64) -> serde_json::Map<String, serde_json::Value> {
    let frames = u64::from(scene.frame_count());
    let costs = plan.entries.iter().filter_map(|entry| Some((entry.effect, entry.cost?.total(frames))));
    costs.map(|(effect, cost)| (effect.as_str().to_owned(), json!(cost as f64 * unit_s))).collect()
}

fn bar(done: u32, count: u32) -> String {
    const WIDTH: usize = 24;
    let full = (WIDTH as u64 * u64::from(done) / u64::from(count.max(1))) as usize;
    format!("[{}{}]", "=".repeat(full.min(WIDTH)), " ".repeat(WIDTH.saturating_sub(full)))
}

/// A time for people.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s >= 10.0 => format!("{s:.0} s"),
        s if s >= 0.1 => format!("{s:.1} s"),
        s if s >= 1e-3 => format!("{:.0} ms", 1e3 * s),
        s => format!("{:.2} ms", 1e3 * s),
    }
}

/// The plan as a table for people.
fn explain(output: &Output, scene: &Scene, plan: &Plan, unit_s: f64) -> Result<(), Failure> {
    let frames = u64::from(scene.frame_count());
    for entry in &plan.entries {
        let (Some(bound), Some(cost)) = (entry.bound, entry.cost) else { continue };
        let size = if bound.px.is_finite() && bound.grey.is_finite() {
            format!("<= {:.2e} px, {:.2e} grey", bound.px, bound.grey)
        } else {
            "is always used".into()
        };
        let mark = if entry.used { "used" } else { "left out" };
        output.say(&format!(
            "  {:<9} {:<16} {:<32} {:>9}  {}",
            mark,
            entry.effect.as_str(),
            size,
            duration(cost.total(frames) as f64 * unit_s),
            entry.why
        ))?;
    }
    let tolerance = scene.file().tolerance;
    output.say(&format!(
        "  left out in all: <= {:.2e} of {} px, {:.2e} of {} grey levels",
        plan.left_out.px, tolerance.px, plan.left_out.grey, tolerance.grey
    ))?;
    if plan.filled_grey > 0.0 {
        output
            .say(&format!("  filled in between rays: <= {:.2} of the same grey levels", plan.filled_grey))?;
    }
    Ok(())
}
