//! A hint for an unknown name: the known name nearest to it.

/// Least number of letters to insert, delete or replace (V. I. Levenshtein, Soviet Physics Doklady 10, 1966).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &other) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(letter != other);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// `; did you mean `x`?`, or nothing where no name is near.
pub fn hint<'a>(found: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    known
        .into_iter()
        .map(|name| (distance(found, name), name))
        .min()
        .filter(|(distance, name)| 2 * distance <= name.chars().count())
        .map_or_else(String::new, |(_, name)| format!("; did you mean `{name}`?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered_and_a_far_one_is_not() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(
            hint("linear-drag", ["lift", "linear_drag"]),
            "; did you mean `linear_drag`?"
        );
        assert_eq!(hint("zzzzzz", ["lift", "linear_drag"]), "");
    }
}
