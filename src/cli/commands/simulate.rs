//! `domecast simulate SCENE`

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::json;

use super::output::{Failure, Output};
use domecast_design::DesignError;
use domecast_files::StagedFolder;
use domecast_sim::run;
use domecast_sim::run::{ContactFault, RunError};
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
    /// Number of frames, instead of the scene's.
    #[arg(long)]
    frames: Option<u32>,
    /// Threads that draw [default: one for each core].
    #[arg(long)]
    threads: Option<usize>,
    /// Seed of everything random, instead of the scene's.
    #[arg(long)]
    seed: Option<u64>,
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
        explain(output, &scene, &plan)?;
        return output.result(&json!({ "ok": true, "scene": scene.name(), "plan": plan }));
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
    for (frame, note) in &summary.notes {
        output.warn(&format!("frame {frame}: {note}"));
    }
    for fault in &summary.contact {
        let ContactFault { status, frames, first, note } = fault;
        output
            .warn(&format!("contact {status} in {frames} of {count} frames, first in frame {first}: {note}"));
    }
    explain(output, &scene, &plan)?;
    let seconds = began.elapsed().as_secs_f64();
    output.say(&format!("{}: {} frames in {seconds:.2} s", out.display(), summary.frames))?;
    output.result(&json!({
        "ok": true,
        "out": out.display().to_string(),
        "frames": summary.frames,
        "notes": summary.notes,
        "contact": summary.contact,
        "work": summary.work.total(),
        "plan": plan,
    }))
}

fn bar(done: u32, count: u32) -> String {
    const WIDTH: usize = 24;
    let full = (WIDTH as u64 * u64::from(done) / u64::from(count.max(1))) as usize;
    format!("[{}{}]", "=".repeat(full.min(WIDTH)), " ".repeat(WIDTH.saturating_sub(full)))
}

/// The plan as a table for people.
fn explain(output: &Output, scene: &Scene, plan: &Plan) -> Result<(), Failure> {
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
            "  {:<9} {:<16} {:<32} work {:>9.2e}  {}",
            mark,
            entry.effect.as_str(),
            size,
            cost.total(frames) as f64,
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
