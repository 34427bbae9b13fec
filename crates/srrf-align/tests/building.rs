//! A building with rooms that look alike, registered by an oracle that takes each for the other, and is sure of it.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::borrow::Cow;
use std::convert::Infallible;

use nalgebra::Vector3;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use srrf_align::{AlignOptions, EdgeVerdict, NoStore, PairAnswer, RegisterPairs, Scans, align};
use srrf_cloud::{KnnIndex, PointCloud, Rigid};
use srrf_corrupt::building::Building;
use srrf_corrupt::views::anywhere;

const ROW: usize = 4;

struct Survey {
    scans: Vec<PointCloud>,
    eyes: Vec<[f64; 3]>,
    map_from_scan: Vec<Rigid>,
    names: Vec<String>,
    /// The points in the building, indexed.
    placed: Vec<KnnIndex>,
}

impl Survey {
    fn new(seed: u64) -> Self {
        let building = Building::new(ROW, 4, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut survey = Self {
            scans: Vec::new(),
            eyes: Vec::new(),
            map_from_scan: Vec::new(),
            names: Vec::new(),
            placed: Vec::new(),
        };
        for (number, station) in building.stations().iter().enumerate() {
            let scan = building.scan(station.eye, [120, 60], 0.004, number as u64).unwrap();
            let scan_from_map = anywhere(
                std::array::from_fn(|_| rng.random_range(-3.0..3.0)),
                std::array::from_fn(|_| rng.random_range(-20.0..20.0)),
            );
            survey.placed.push(KnnIndex::new(scan.points()).unwrap());
            let moved = scan.points().iter().map(|p| scan_from_map.apply(p)).collect();
            survey.scans.push(PointCloud::new(moved).unwrap());
            survey.eyes.push(scan_from_map.apply(&station.eye));
            survey.map_from_scan.push(scan_from_map.inverse());
            survey.names.push(station.name.clone());
        }
        survey
    }

    /// Share of the points of one, moved in the building, that lie on another.
    fn overlap(&self, source: usize, target: usize, by: &Vector3<f64>) -> f64 {
        let points = self.placed[source].points().iter().step_by(29);
        let on = |p: &[f64; 3]| {
            let moved = (Vector3::from(*p) + by).into();
            self.placed[target].nearest(&moved).1 < 0.15f64.powi(2)
        };
        let count = points.clone().count();
        points.filter(|p| on(p)).count() as f64 / count as f64
    }

    /// Where a room or door (with its number) stands, if it looks like that of another: same kind, same way round.
    fn alike(&self, source: usize, target: usize) -> Option<Vector3<f64>> {
        let number = |i: usize| {
            let (what, number) = self.names[i].split_once('-')?;
            ["room", "door"].contains(&what).then(|| number.parse::<usize>().ok()).flatten()
        };
        let (a, b) = (number(source)?, number(target)?);
        let place = |n: usize| {
            // The far walls, as the building has them: width 4.5, depth 5, corridors of 2.4.
            Vector3::new(4.5 * (n % ROW) as f64, [-5.0, 7.4, 7.4, 19.8][n / ROW], 0.0)
        };
        (a != b && a % 3 == b % 3 && (a / ROW) % 2 == (b / ROW) % 2).then(|| place(b) - place(a))
    }

    fn relative(&self, source: usize, target: usize) -> Rigid {
        self.map_from_scan[target].inverse().compose(&self.map_from_scan[source])
    }
}

struct Seen<'a>(&'a Survey);

impl Scans for Seen<'_> {
    type Error = Infallible;

    fn count(&self) -> usize {
        self.0.scans.len()
    }

    fn viewpoint(&self, number: usize) -> Option<[f64; 3]> {
        Some(self.0.eyes[number])
    }

    fn cloud(&self, number: usize) -> Result<Cow<'_, PointCloud>, Infallible> {
        Ok(Cow::Borrowed(&self.0.scans[number]))
    }
}

impl RegisterPairs for Survey {
    type Target = usize;
    type Error = Infallible;

    fn prepare(&self, target: &PointCloud) -> Result<usize, Infallible> {
        Ok(self.scans.iter().position(|s| s == target).unwrap())
    }

    fn register(
        &self,
        source: &PointCloud,
        target: &usize,
        _: Option<Rigid>,
    ) -> Result<PairAnswer, Infallible> {
        let source = self.prepare(source)?;
        let sure = |pose| PairAnswer {
            target_from_source: Some(pose),
            probability: 0.96,
            probability_of_fit: 0.96,
            abstain: false,
            others: Vec::new(),
        };
        if self.overlap(source, *target, &Vector3::zeros()) > 0.3 {
            return Ok(sure(self.relative(source, *target)));
        }
        let wrong = self.alike(source, *target).filter(|by| self.overlap(source, *target, by) > 0.5);
        Ok(match wrong {
            Some(by) => {
                let slid = Rigid { translation: by, ..Rigid::identity() };
                sure(
                    self.map_from_scan[*target].inverse().compose(&slid).compose(&self.map_from_scan[source]),
                )
            }
            None => PairAnswer::NOTHING,
        })
    }
}

#[test]
fn rooms_that_look_alike_are_not_laid_on_each_other() {
    let survey = Survey::new(5);
    let map = align(&Seen(&survey), &survey, &AlignOptions::default(), &NoStore, &|_| {}).unwrap();
    for members in &map.components {
        let pose = |i: usize| map.scans[i].map_from_scan;
        for &i in members {
            let found = pose(members[0]).inverse().compose(&pose(i));
            let off = survey.relative(i, members[0]).inverse().compose(&found);
            let (turned, moved) = (off.angle_to_deg(&Rigid::identity()), survey.eyes[i]);
            let moved = (Vector3::from(off.apply(&moved)) - Vector3::from(moved)).norm();
            assert!(turned < 1.0 && moved < 0.2, "{} by {moved} m, {turned} degrees", survey.names[i]);
        }
    }
    // Few scans or none get into a map together here; it is said why.
    assert!(map.look_alike);
    // The oracle did mislead.
    let misled = map.edges.iter().filter(|e| {
        let pose = e.target_from_source.filter(|_| e.probability > 0.9);
        pose.is_some_and(|p| {
            survey.relative(e.source, e.target).inverse().compose(&p).translation.norm() > 1.0
        })
    });
    let (all, held): (usize, usize) =
        misled.fold((0, 0), |(all, held), e| (all + 1, held + usize::from(e.verdict == EdgeVerdict::Holds)));
    assert!(all > 5 && held == 0, "{held} of {all}");
}
