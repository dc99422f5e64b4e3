//! From a spec to shards: which pairs each holds, and making one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::check::{Dataset, sha256_hex};
use crate::draw::PairDraw;
use crate::record::{self, Made};
use crate::sensor::BuiltSensor;
use crate::tar::Archive;
use crate::video::{NoVideo, simulate};
use crate::{readings, tracked};
use domecast_design::DesignError;
use domecast_sim::SimError;

/// Draws of a pair before the spec is said to be at fault.
const MAX_ATTEMPTS: u32 = 60;
/// Videos of a shard unless somebody says how many shards there are.
const USUAL_VIDEOS: u32 = 64;
/// Pairs that are made between two reports of progress, for each thread: enough of them that threads seldom wait for the slowest pair.
const PAIRS_AT_ONCE: usize = 8;

/// A shard: a range of pairs, in a file of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shard {
    /// Its number.
    pub index: u32,
    /// Its file's name.
    pub file: String,
    /// Its first pair.
    pub first: u32,
    /// How many pairs it holds.
    pub pairs: u32,
}

/// Makes shards; keeps the sensors that it has built.
pub struct Maker<'a> {
    dataset: &'a Dataset,
    sensors: Mutex<BTreeMap<u32, Arc<BuiltSensor>>>,
}

impl Dataset {
    /// Number of shards unless somebody says otherwise.
    pub fn usual_shards(&self) -> u32 {
        self.spec.videos.div_ceil(USUAL_VIDEOS).max(1)
    }

    /// The shards of the set, `count` of them.
    ///
    /// # Errors
    /// No shard at all, or more than there are pairs.
    pub fn shards(&self, count: u32) -> Result<Vec<Shard>, DesignError> {
        let pairs = self.pairs();
        if count == 0 || count > pairs {
            let allowed = format!("1 to {pairs}, the number of pairs of videos");
            return Err(DesignError::at("--shards", count, "not a number of shards", allowed));
        }
        let begin = |index: u32| (u64::from(index) * u64::from(pairs) / u64::from(count)) as u32;
        Ok((0..count)
            .map(|index| {
                let (first, end) = (begin(index), begin(index + 1));
                let range = format!("{first} {end}");
                let hash = sha256_hex(&[self.hash.as_bytes(), range.as_bytes()]);
                let short = hash.get(..8).unwrap_or_default();
                let file = format!("{}-{index:05}-of-{count:05}-{short}.tar", self.spec.name);
                Shard { index, file, first, pairs: end - first }
            })
            .collect())
    }
}

impl<'a> Maker<'a> {
    /// A maker of a set's shards.
    pub fn new(dataset: &'a Dataset) -> Self {
        Self { dataset, sensors: Mutex::default() }
    }

    /// The bytes of a shard; `progress` gets the number of its videos that are made.
    ///
    /// # Errors
    /// A sensor that cannot be built, or a pair for which no draw is sound.
    pub fn shard(&self, shard: &Shard, progress: &mut dyn FnMut(u32)) -> Result<Vec<u8>, SimError> {
        let mut archive = Archive::default();
        let all: Vec<u32> = (shard.first..shard.first + shard.pairs).collect();
        let at_once = PAIRS_AT_ONCE * rayon::current_num_threads().max(1);
        let mut done = 0;
        for pairs in all.chunks(at_once) {
            // Before the pairs, which share them: the parts of a sensor are computed in parallel, and a pair that waited for a sensor would
            // keep that one's parts from being done. Sensors do not wait for each other: none is asked for twice.
            let numbers: BTreeSet<u32> = pairs.iter().map(|pair| self.dataset.sensor_of(*pair)).collect();
            self.kept().retain(|number, _| numbers.contains(number));
            numbers.par_iter().try_for_each(|number| self.sensor(*number).map(|_| ()))?;
            let made: Vec<Result<[Made; 2], SimError>> =
                pairs.par_iter().map(|pair| self.pair(*pair)).collect();
            for (pair, made) in pairs.iter().zip(made) {
                for (number, made) in (2 * pair..).zip(made?) {
                    record::add(&mut archive, self.dataset, number, &made);
                }
                done += 2;
            }
            progress(done);
        }
        Ok(archive.finish())
    }

    /// A sensor, built when it is first asked for.
    ///
    /// # Errors
    /// As [`Dataset::build_sensor`].
    pub fn sensor(&self, number: u32) -> Result<Arc<BuiltSensor>, SimError> {
        if let Some(found) = self.kept().get(&number) {
            return Ok(Arc::clone(found));
        }
        let built = Arc::new(self.dataset.build_sensor(number)?);
        Ok(Arc::clone(self.kept().entry(number).or_insert(built)))
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<u32, Arc<BuiltSensor>>> {
        // whoever died while it held the map left it whole
        self.sensors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Both videos of a pair, drawn again until both are sound.
    ///
    /// # Errors
    /// As [`Maker::shard`].
    pub fn pair(&self, pair: u32) -> Result<[Made; 2], SimError> {
        let sensor = self.sensor(self.dataset.sensor_of(pair))?;
        let mut last = String::new();
        for attempt in 0..MAX_ATTEMPTS {
            let draw = self.dataset.draw(pair, attempt);
            // the softer one is refused more often: it goes first
            let soft = 2 * pair + self.dataset.first_of(pair) as u32;
            let made = self.video(&sensor, &draw, soft).and_then(|first| {
                let other = self.video(&sensor, &draw, soft ^ 1)?;
                Ok(if soft.is_multiple_of(2) { [first, other] } else { [other, first] })
            });
            match made {
                Ok(made) => return Ok(made),
                Err(NoVideo::Fault(error)) => return Err(error),
                Err(NoVideo::Refused(why)) => last = why.0,
            }
        }
        let name = &self.dataset.spec.shapes[self.dataset.draw(pair, 0).shape_index].name;
        let problem = format!(
            "`{name}` (pair {pair}): no draw of {MAX_ATTEMPTS} gives two sound videos; the last: {last}"
        );
        let allowed = "shapes, forces and places that the sensor can carry; see `press` and `scale`";
        Err(DesignError::at("shapes", "", problem, allowed).into())
    }

    fn video(&self, sensor: &BuiltSensor, draw: &PairDraw, number: u32) -> Result<Made, NoVideo> {
        let dataset = self.dataset;
        let seed = dataset.noise_seed(number);
        let young_mpa = dataset.hardness_of(number).1;
        let video = simulate(dataset, sensor, draw, (young_mpa, seed))?;
        let readings = match &sensor.full {
            None => readings::modelled(dataset, sensor, &video, seed),
            Some(full) => tracked::tracked(dataset, (sensor, full), draw, (young_mpa, seed), &video)?,
        };
        let label = record::label(dataset, draw, &video, number);
        Ok(Made { video, readings, label })
    }
}
