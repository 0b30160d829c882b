//! Log posteriors of sets as sweeps have told them so far: about the sets themselves, and to first order from elsewhere.

use std::collections::{BTreeMap, BTreeSet};

use crate::{likelihood::found::Found, options::LikelihoodOptions};

/// Log posteriors of sets, by where the readings were linearised.
#[derive(Debug, Default)]
pub(super) struct Seen {
    /// About the set itself: the best of what was seen counts.
    about: Logs,
    /// To first order from other points, point by point.
    elsewhere: Vec<Logs>,
    /// From which set's point to which set's it went.
    ways: BTreeSet<[Vec<usize>; 2]>,
    /// Effects that are expected, and so in most sets.
    expected: BTreeSet<usize>,
}

/// Log posterior by set.
type Logs = BTreeMap<Vec<usize>, f64>;

impl Seen {
    /// Nothing yet; these effects are expected.
    pub(super) fn beside(expected: BTreeSet<usize>) -> Self {
        Self {
            expected,
            ..Self::default()
        }
    }

    /// Log posterior of a set about itself.
    pub(super) fn learn(&mut self, set: &[usize], log: f64) {
        keep_best(&mut self.about, set, log);
    }

    /// Sets about which there was a sweep, and their log posteriors there.
    pub(super) fn about(&self) -> impl Iterator<Item = (&[usize], f64)> {
        self.about.iter().map(|(set, log)| (&set[..], *log))
    }

    /// Log posterior of a set about itself; minus infinity where there was no sweep about it.
    pub(super) fn log(&self, set: &[usize]) -> f64 {
        self.about.get(set).copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// True where a sweep about a set was tried.
    pub(super) fn is_known(&self, set: &[usize]) -> bool {
        self.about.contains_key(set)
    }

    /// Remembers the way from one set's point to another's.
    pub(super) fn go(&mut self, from: Vec<usize>, to: &[usize]) {
        self.ways.insert([from, to.to_vec()]);
    }

    /// True where it went from one set's point to another's.
    pub(super) fn went(&self, from: &[usize], to: &[usize]) -> bool {
        self.ways.contains(&[from.to_vec(), to.to_vec()])
    }

    /// True for large sets that share `least` effects and more than half of all, expected ones aside: what first order gets
    /// wrong of one it gets wrong of the other.
    fn is_alike(&self, one: &[usize], other: &[usize], least: usize) -> bool {
        let of = |set: &[usize]| -> BTreeSet<usize> {
            let all = set.iter().copied();
            all.filter(|of| !self.expected.contains(of)).collect()
        };
        let (one, other) = (of(one), of(other));
        let shared = one.intersection(&other).count();
        shared >= least && 2 * shared > one.union(&other).count()
    }

    /// Keeps what is found from one point.
    pub(super) fn keep(&mut self, found: &[Found]) {
        let mut logs = Logs::new();
        for of in found {
            keep_best(&mut logs, &of.set, of.log_posterior);
        }
        self.elsewhere.push(logs);
    }

    /// A set that is likelier `here`, to first order from the best's point, than it was about itself by more than `[_, lag]`: its
    /// values settled in a lesser place. Not one that is `[far, _]` behind the best even so, nor one that the way led to from
    /// there before.
    pub(super) fn lagging(
        &self,
        best: &[usize],
        here: impl Fn(&[usize]) -> Option<Found>,
        [far, lag]: [f64; 2],
    ) -> Option<Found> {
        let least = self.log(best) - far;
        let others = (self.about()).filter(|(set, _)| *set != best && !self.went(best, set));
        let mut others = others.filter_map(|(set, there)| Some((there, here(set)?)));
        let is_lagging = |there: f64, here: f64| here > least && here > there + lag;
        let lagging = others.find(|(there, here)| is_lagging(*there, here.log_posterior));
        lagging.map(|of| of.1)
    }

    /// Candidates worth another look: those in sets `within` so much of the best of what was seen from some point.
    pub(super) fn worth(&self, within: f64) -> BTreeSet<usize> {
        let near = self.elsewhere.iter().flat_map(|logs| {
            let best = logs.values().copied().fold(f64::NEG_INFINITY, f64::max);
            logs.iter().filter(move |of| *of.1 > best - within)
        });
        near.flat_map(|of| of.0.iter().copied()).collect()
    }

    /// The likeliest set about which there was no sweep, if it may come near the best. What holds all of the best is
    /// left out: the sweep about the best tells of it. From each point a set is as likely as first order has it, less what a part
    /// of it, or a large set that is most of it, lost about itself; where none lost, more by what the point's likeliest set gained
    /// about itself.
    pub(super) fn rival(&self, options: &LikelihoodOptions) -> Option<&[usize]> {
        let best = self.about().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut rival: Option<(&[usize], f64)> = None;
        for logs in &self.elsewhere {
            let Some(likeliest) = logs.iter().max_by(|a, b| a.1.total_cmp(b.1)) else {
                continue;
            };
            let gained = (self.log(likeliest.0) - likeliest.1).max(0.0);
            let is_open = |set: &[usize]| !self.is_known(set) && !is_part(best.0, set);
            for (set, log) in logs.iter().filter(|of| is_open(of.0)) {
                let parts = self
                    .about()
                    .filter(|of| is_part(of.0, set) || self.is_alike(of.0, set, options.shared));
                let lost = parts.filter_map(|(part, there)| Some(logs.get(part)? - there));
                let lost = lost.fold(0.0, f64::max);
                let hoped = log - if lost > 0.0 { lost } else { -gained };
                if hoped > best.1 - options.rival_within && rival.is_none_or(|of| hoped > of.1) {
                    rival = Some((set, hoped));
                }
            }
        }
        rival.map(|of| of.0)
    }
}

fn keep_best(logs: &mut Logs, set: &[usize], log: f64) {
    let of = logs.entry(set.to_vec()).or_insert(log);
    *of = of.max(log);
}

/// True where a set loses what another `lost`, to first order from a point of the set `own`: it holds all of one that added to the
/// point's, or leaves out all that one without additions left out.
pub(super) fn loses_too(own: &[usize], lost: &[usize], set: &[usize]) -> bool {
    let adds = lost.iter().any(|of| !own.contains(of));
    let mut left_out = own.iter().filter(|of| !lost.contains(of)).peekable();
    match adds {
        true => is_part(lost, set),
        false => left_out.peek().is_some() && left_out.all(|of| !set.contains(of)),
    }
}

/// True for some effects, all of which are in a set.
fn is_part(part: &[usize], set: &[usize]) -> bool {
    !part.is_empty() && part.iter().all(|of| set.contains(of))
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::likelihood::truncated_evidence::Truncated;

    /// The rival within 3 nats.
    fn rival(seen: &Seen) -> Option<&[usize]> {
        seen.rival(&LikelihoodOptions {
            rival_within: 3.0,
            ..LikelihoodOptions::default()
        })
    }

    fn found(set: &[usize], log_posterior: f64) -> Found {
        Found {
            set: set.to_vec(),
            level: 0,
            members: Vec::new(),
            columns: Vec::new(),
            own: Default::default(),
            held: Default::default(),
            mixtures: Vec::new(),
            posterior: Truncated {
                log_evidence: 0.0,
                mean: DVector::zeros(0),
                covariance: DMatrix::zeros(0, 0),
            },
            log_likelihood: log_posterior,
            log_posterior,
        }
    }

    /// From nothing two sets are alike; about itself one gains, and the other might have too.
    #[test]
    fn what_the_best_gained_about_itself_is_given_to_a_rival() {
        let mut seen = Seen::default();
        seen.learn(&[], -900.0);
        seen.keep(&[
            found(&[], -880.0),
            found(&[1], -588.0),
            found(&[2], -590.0),
            found(&[3], -620.0),
        ]);
        seen.learn(&[1], -579.0);
        seen.keep(&[
            found(&[1], -579.0),
            found(&[1, 3], -580.0),
            found(&[2], -600.0),
        ]);
        assert_eq!(rival(&seen), Some(&[2][..]));
        seen.learn(&[2], -570.0);
        assert_eq!(rival(&seen), None);
        assert_eq!(seen.log(&[2]), -570.0);
    }

    /// A set that first order had likelier than the best turned out is looked at.
    #[test]
    fn a_set_that_was_passed_over_is_a_rival() {
        let mut seen = Seen::default();
        seen.keep(&[found(&[1], -612.0), found(&[2], -615.0)]);
        seen.learn(&[1], -621.0);
        assert_eq!(rival(&seen), Some(&[2][..]));
        // A trial blew up about it: nor are sets that hold it.
        seen.learn(&[2], f64::NEG_INFINITY);
        assert_eq!(rival(&seen), None);
    }

    /// A large set that is most of one that lost is not tried; a small one is.
    #[test]
    fn what_most_of_a_large_set_lost_it_loses() {
        let mut seen = Seen::beside([9].into());
        seen.keep(&[
            found(&[1, 2, 3, 4, 9], -500.0),
            found(&[1, 2, 3, 5, 9], -501.0),
            found(&[1, 5, 9], -520.0),
        ]);
        seen.learn(&[7], -560.0);
        seen.learn(&[1, 2, 3, 4, 9], -600.0);
        assert_eq!(rival(&seen), Some(&[1, 5, 9][..]));
    }

    /// Nothing settled 20 nats below what it is from the best's point: it is fitted again from there, once.
    #[test]
    fn a_set_that_settled_in_a_lesser_place_lags() {
        let mut seen = Seen::default();
        seen.learn(&[], -620.0);
        seen.learn(&[1], -600.0);
        seen.learn(&[2], -700.0);
        let here = |set: &[usize]| {
            let log = match set {
                [] => -598.0,
                [2] => -650.0,
                _ => -600.0,
            };
            Some(found(set, log))
        };
        let lagging = |seen: &Seen| seen.lagging(&[1], here, [20.0, 1.0]).map(|of| of.set);
        assert_eq!(lagging(&seen), Some(vec![]));
        // The other one lags too, and is far behind even so.
        seen.go(vec![1], &[]);
        assert_eq!(lagging(&seen), None);
    }

    /// What an addition lost all lose that hold it, and what an omission lost all that omit as much.
    #[test]
    fn what_a_set_lost_others_lose() {
        let own = [1, 2, 3];
        for (lost, set, does) in [
            (&[1, 2, 3, 4][..], &[1, 2, 3, 4, 5][..], true),
            (&[1, 4], &[1, 4], true),
            (&[1, 4], &[1, 2, 3], false),
            (&[1, 2], &[1, 2, 5], true),
            (&[1, 2], &[5], true),
            (&[1, 2], &[1, 3], false),
            (&[1], &[1, 2], false),
            (&[], &[4], true),
            (&[], &[3, 4], false),
            (&own, &[1, 2, 3, 4], false),
        ] {
            assert_eq!(loses_too(&own, lost, set), does, "{lost:?} {set:?}");
        }
    }

    /// A set that holds what was worse about itself than from there is as much worse.
    #[test]
    fn what_a_part_lost_the_whole_loses() {
        let mut seen = Seen::default();
        seen.keep(&[
            found(&[1], -569.0),
            found(&[1, 2], -566.0),
            found(&[3], -708.0),
        ]);
        seen.learn(&[], -840.0);
        assert_eq!(rival(&seen), Some(&[1, 2][..]));
        seen.learn(&[1], -1242.0);
        assert_eq!(rival(&seen), Some(&[3][..]));
    }
}
