//! All checks, in the order in which they are told: each needs only such as come before it.

use super::{
    close, create, descriptor, destroy, emits, entry, growth, input, load, manners, output, param,
    param_table, repeat, reset, schema, services, size, state, state_refused, step, subject::Subject, time,
    verdict::Outcome,
};

/// One check.
pub(super) struct Check {
    /// `family-subject`.
    pub(super) name: &'static str,
    /// What a sound plugin does, in one sentence.
    pub(super) about: &'static str,
    /// The rule behind it.
    pub(super) rule: Rule,
    /// Checks without which this one means nothing.
    pub(super) needs: &'static [&'static str],
    /// Runs once a library, or once a plugin of it.
    pub(super) of: Of,
    /// Looks.
    pub(super) run: fn(&Subject) -> Outcome,
}

/// What a check is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    /// The library.
    Library,
    /// Each plugin in it.
    Plugin,
}

/// Where a rule stands, in its own words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    /// In the comments of reef_sim.h.
    Header(&'static str),
    /// In the guide for plugin authors.
    Guide(&'static str),
}

impl Rule {
    /// Where, for people.
    pub(super) fn place(self) -> &'static str {
        match self {
            Self::Header(_) => "reef_sim.h",
            Self::Guide(_) => "the guide for plugin authors",
        }
    }

    /// Its words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Header(words) | Self::Guide(words) => words,
        }
    }
}

impl Check {
    /// Is it of this name, or of a family whose name begins so?
    pub(super) fn is_called(&self, name: &str) -> bool {
        self.name
            .strip_prefix(name)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('-') || name.ends_with('-'))
    }
}

/// One family after another.
const FAMILIES: &[&[Check]] = &[
    entry::CHECKS,
    load::CHECKS,
    close::CHECKS,
    manners::CHECKS,
    descriptor::CHECKS,
    schema::CHECKS,
    param_table::CHECKS,
    create::CHECKS,
    step::FIRST,
    emits::CHECKS,
    state::FIRST,
    repeat::FIRST,
    step::CHECKS,
    input::CHECKS,
    services::CHECKS,
    output::CHECKS,
    destroy::CHECKS,
    reset::CHECKS,
    param::CHECKS,
    state::CHECKS,
    param::SAVED,
    state_refused::CHECKS,
    size::CHECKS,
    repeat::CHECKS,
    growth::CHECKS,
    time::CHECKS,
];

/// All checks.
pub(super) fn all() -> impl Iterator<Item = &'static Check> {
    FAMILIES.iter().flat_map(|family| family.iter())
}

/// The check with this name.
pub(super) fn find(name: &str) -> Option<&'static Check> {
    all().find(|check| check.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_needs_come_before() {
        let names: Vec<&str> = all().map(|check| check.name).collect();
        assert!(names.len() >= 60, "{} checks", names.len());
        for (at, check) in all().enumerate() {
            assert!(!names[..at].contains(&check.name), "{}: twice", check.name);
            for need in check.needs {
                assert!(
                    names[..at].contains(need),
                    "{} needs {need}, which does not come before it",
                    check.name
                );
            }
            let well = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
            assert!(check.name.chars().all(well) && check.name.contains('-'), "{}", check.name);
            assert!(check.about.ends_with('.') && check.about.len() < 120, "{}: {}", check.name, check.about);
        }
    }

    /// Text without the signs of comments and line ends.
    fn plain(text: &str) -> String {
        let lines = text.lines().map(|line| line.trim().trim_start_matches("/*").trim_start_matches('*'));
        lines.collect::<Vec<_>>().join(" ").split_whitespace().collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn every_rule_stands_where_it_is_said_to_stand() {
        let header = plain(include_str!("../../../sim-plugins/abi/reef_sim.h"));
        let guide = plain(include_str!("../../../sim-plugins/README.md"));
        for check in all() {
            let text = if matches!(check.rule, Rule::Header(_)) { &header } else { &guide };
            assert!(text.contains(check.rule.words()), "{}: {:?}", check.name, check.rule);
        }
    }

    #[test]
    fn a_family_is_called_by_the_beginning_of_its_names() {
        let check = find("state-saves").unwrap();
        assert!(check.is_called("state") && check.is_called("state-") && check.is_called("state-saves"));
        assert!(!check.is_called("stat") && !check.is_called("state-save") && !check.is_called("saves"));
    }
}
