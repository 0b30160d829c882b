//! Names of initial forces.

use super::*;

#[test]
fn names_are_read_back_and_others_refused() {
    for choice in InitialForce::ALL {
        assert_eq!(choice.to_string().parse(), Ok(choice));
    }
    assert!("one".parse::<InitialForce>().is_err());
}
