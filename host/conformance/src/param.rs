//! Parameters of living instances: they change through events only, stay in their ranges, and belong to the
//! state.

use reef_abi as abi;
use reef_plugin::{Instance, ParamInfo, ParamKind, Plugin};

use super::{
    sea::Sea,
    step::WORKS,
    subject::{Subject, difference, offers, payload, run, set, step},
    table::{
        Check, Of,
        Rule::{Guide, Header},
    },
    verdict::{Not, Outcome, broken, must},
};

const EVENTS: &str = "The parameter's present value. Parameters change through the step's events only.";
const NOW: &str = "the parameter `param` is now `value`";
const RANGE: &str = "In C, keep them yourself, and take each into its range";

/// What comes after the checks of states.
pub(super) const SAVED: &[Check] = &[check(
    "param-saved",
    &["param-get", "state-loads"],
    "A state carries the values of parameters.",
    Guide("State and parameters"),
    saved,
)];

/// What most of them need.
const GET: &[&str] = &["param-get"];

pub(super) const CHECKS: &[Check] = &[
    Check {
        name: "param-get",
        about: "get_param() tells the value of every parameter, and of nothing else.",
        rule: Header(EVENTS),
        needs: WORKS,
        of: Of::Plugin,
        run: get,
    },
    check(
        "param-first",
        GET,
        "A fresh instance has values that its parameters can take: their defaults, without a configuration.",
        Header(EVENTS),
        fresh,
    ),
    check("param-set", GET, "An event sets a parameter to its value.", Header(NOW), set_each),
    check(
        "param-order",
        GET,
        "Of two events in one step, the last one counts.",
        Header("What came from outside in this step, in the journal's order."),
        order,
    ),
    check(
        "param-beyond",
        GET,
        "A value outside of the range is taken into it, or refused.",
        Guide(RANGE),
        beyond,
    ),
    check(
        "param-nan",
        GET,
        "A value that is no number is refused.",
        Guide("NaN is refused, too."),
        no_number,
    ),
    check(
        "param-whole",
        GET,
        "Whole numbers, switches and choices take whole values.",
        Header("0 .. choice_count - 1"),
        whole,
    ),
    check(
        "param-stranger",
        GET,
        "An event of a parameter that is not there changes nothing.",
        Header("stable for ever; not an index; not 0"),
        stranger,
    ),
    check(
        "param-apart",
        GET,
        "Two instances have parameters of their own.",
        Header("The parameter's present value."),
        apart,
    ),
    check(
        "param-reset",
        &["param-get", "reset-works"],
        "reset() takes parameters back, too.",
        Header("Back to the state after create(), parameters included."),
        reset,
    ),
];

const fn check(
    name: &'static str,
    needs: &'static [&'static str],
    about: &'static str,
    rule: super::table::Rule,
    run: fn(&Subject) -> Outcome,
) -> Check {
    Check { name, about, rule, needs, of: Of::Plugin, run }
}

/// A new instance of a plugin that has parameters.
fn with_params(subject: &Subject) -> Result<(Plugin, Instance, Vec<ParamInfo>), Not> {
    let (plugin, instance) = subject.fresh()?;
    let params = plugin.info().params.clone();
    if params.is_empty() {
        return Err(Not::There("there are no parameters".into()));
    }
    if !offers(&instance, "get_param") {
        return Err(Not::There("it has no get_param".into()));
    }
    Ok((plugin, instance, params))
}

/// Can the parameter have this value?
fn takes(param: &ParamInfo, value: f64) -> bool {
    let whole = param.kind == ParamKind::Float || value.fract() == 0.0;
    whole && (param.minimum..=param.maximum).contains(&value)
}

/// A value that is neither the default nor at an end of the range, where there is such a one.
pub(super) fn other(param: &ParamInfo) -> f64 {
    let inside = param.minimum + 0.375 * (param.maximum - param.minimum);
    let value = if param.kind == ParamKind::Float { inside } else { inside.round() };
    let another =
        if value == param.default && param.kind != ParamKind::Float { param.maximum } else { value };
    if another == param.default { param.minimum } else { another }
}

/// The value that it has, which must be as wanted.
fn has(instance: &Instance, param: &ParamInfo, wanted: f64, when: &str) -> Result<(), Not> {
    let value = instance.param(param.id)?;
    must!(value == wanted, "parameter `{}` is {value} {when}: it should be {wanted}", param.key);
    Ok(())
}

fn get(subject: &Subject) -> Outcome {
    let (plugin, instance) = subject.stepped(2)?;
    if !offers(&instance, "get_param") {
        return Err(Not::There("it has no get_param".into()));
    }
    let params = &plugin.info().params;
    for param in params {
        instance.param(param.id)?;
    }
    for id in [0, 0x7fff_fff1, u32::MAX] {
        if params.iter().all(|param| param.id != id)
            && let Ok(value) = instance.param(id)
        {
            broken!("there is no parameter {id}, and get_param() says that it is {value}");
        }
    }
    Ok(None)
}

fn fresh(subject: &Subject) -> Outcome {
    let (_plugin, instance, params) = with_params(subject)?;
    for param in &params {
        let value = instance.param(param.id)?;
        let range = (param.minimum, param.maximum);
        must!(takes(param, value), "parameter `{}` is {value}, which is no value of {range:?}", param.key);
        if !subject.config.is_given() {
            has(&instance, param, param.default, "after create()")?;
        }
    }
    Ok(None)
}

fn set_each(subject: &Subject) -> Outcome {
    let (_plugin, mut instance, params) = with_params(subject)?;
    for value_of in [|p: &ParamInfo| p.minimum, |p: &ParamInfo| p.maximum, other, |p: &ParamInfo| p.default] {
        for param in &params {
            let value = value_of(param);
            set(&mut instance, &[(param.id, value)])?;
            has(&instance, param, value, "after an event set it")?;
        }
    }
    let all: Vec<(u32, f64)> = params.iter().map(|param| (param.id, other(param))).collect();
    set(&mut instance, &all)?;
    for param in &params {
        has(&instance, param, other(param), "after one step's events set all")?;
    }
    Ok(None)
}

fn order(subject: &Subject) -> Outcome {
    let (_plugin, mut instance, params) = with_params(subject)?;
    for param in &params {
        set(
            &mut instance,
            &[(param.id, other(param)), (param.id, param.maximum), (param.id, param.minimum)],
        )?;
        has(&instance, param, param.minimum, "after three events, the last of which set its least value")?;
    }
    Ok(None)
}

fn beyond(subject: &Subject) -> Outcome {
    let (_plugin, mut instance, params) = with_params(subject)?;
    for param in &params {
        let span = param.maximum - param.minimum + 1.0;
        for value in [param.minimum - span, param.maximum + span, 1e300, -1e300] {
            set(&mut instance, &[(param.id, value)])?;
            let now = instance.param(param.id)?;
            let range = (param.minimum, param.maximum);
            must!(
                takes(param, now),
                "after an event with {value}, parameter `{}` of {range:?} is {now}",
                param.key
            );
        }
    }
    Ok(None)
}

fn no_number(subject: &Subject) -> Outcome {
    let (_plugin, mut instance, params) = with_params(subject)?;
    for param in &params {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            set(&mut instance, &[(param.id, value)])?;
            let now = instance.param(param.id)?;
            must!(takes(param, now), "after an event with {value}, parameter `{}` is {now}", param.key);
        }
    }
    Ok(None)
}

fn whole(subject: &Subject) -> Outcome {
    let (_plugin, mut instance, params) = with_params(subject)?;
    let mut any = false;
    for param in params.iter().filter(|param| param.kind != ParamKind::Float) {
        any = true;
        for part in [0.25, 0.5, 0.75] {
            set(&mut instance, &[(param.id, param.minimum + part)])?;
            let now = instance.param(param.id)?;
            must!(
                takes(param, now),
                "after an event with {}, parameter `{}` is {now}",
                param.minimum + part,
                param.key
            );
        }
    }
    if any { Ok(None) } else { Err(Not::There("all of its parameters are real numbers".into())) }
}

fn stranger(subject: &Subject) -> Outcome {
    let (plugin, mut instance, params) = with_params(subject)?;
    let mut untouched = subject.create(&plugin)?;
    let ids: Vec<u32> =
        [0, 77, u32::MAX].into_iter().filter(|id| params.iter().all(|param| param.id != *id)).collect();
    for number in 0..10 {
        let strange =
            |&param: &u32| abi::Event { kind: abi::EVENT_PARAM, param, value: 0.75, ..Default::default() };
        let events: Vec<abi::Event> = ids.iter().map(strange).collect();
        step(&mut instance, &Sea::usual().input(number), &events)?;
        step(&mut untouched, &Sea::usual().input(number), &[])?;
    }
    for param in &params {
        has(&instance, param, untouched.param(param.id)?, "after events of parameters that are not there")?;
    }
    if offers(&instance, "save_state")
        && let Some(difference) = difference(&payload(&mut untouched)?, &payload(&mut instance)?)
    {
        broken!("after events of parameters that are not there, the state is another: {difference}");
    }
    Ok(None)
}

fn apart(subject: &Subject) -> Outcome {
    let (plugin, mut one, params) = with_params(subject)?;
    let mut two = subject.create(&plugin)?;
    run(&mut two, &Sea::usual(), 0..2)?;
    for param in &params {
        let before = two.param(param.id)?;
        set(&mut one, &[(param.id, other(param))])?;
        run(&mut two, &Sea::usual(), 2..3)?;
        has(&two, param, before, "after an event of another instance")?;
    }
    Ok(None)
}

fn reset(subject: &Subject) -> Outcome {
    let (plugin, mut instance, params) = with_params(subject)?;
    if !offers(&instance, "reset") {
        return Err(Not::There("it has no reset".into()));
    }
    let all: Vec<(u32, f64)> = params.iter().map(|param| (param.id, other(param))).collect();
    set(&mut instance, &all)?;
    instance.reset()?;
    let fresh = subject.create(&plugin)?;
    for param in &params {
        has(&instance, param, fresh.param(param.id)?, "after reset()")?;
    }
    Ok(None)
}

fn saved(subject: &Subject) -> Outcome {
    let (plugin, mut instance, params) = with_params(subject)?;
    if !offers(&instance, "save_state") || !offers(&instance, "load_state") {
        return Err(Not::There("it does not save and load states".into()));
    }
    let all: Vec<(u32, f64)> = params.iter().map(|param| (param.id, other(param))).collect();
    set(&mut instance, &all)?;
    let state = instance.save()?;
    let mut fresh = subject.create(&plugin)?;
    fresh.load(&state)?;
    for param in &params {
        has(&fresh, param, instance.param(param.id)?, "in another instance that loaded the state")?;
    }
    Ok(None)
}
