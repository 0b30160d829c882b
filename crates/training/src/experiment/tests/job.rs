//! Names of jobs.

use super::*;

#[test]
fn names_are_read_back_and_others_refused() {
    let job = JobId {
        data: "1.2".to_owned(),
        entry: "lstm".to_owned(),
        seed: 7,
    };
    assert_eq!(job.to_string().parse(), Ok(job));
    for wrong in [
        "",
        "2/lstm",
        "2/lstm/7",
        "2/lstm/seed-x",
        "2/lstm/seed-0/more",
    ] {
        assert!(wrong.parse::<JobId>().is_err(), "{wrong}");
    }
}
