//! Parameters: declared once, stored and clamped here, changed only by a step's events.

use reef_abi as abi;

/// What values a parameter takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParamKind {
    /// Any number in the range.
    Float,
    /// Whole numbers in the range.
    Int,
    /// 0 or 1.
    Switch,
    /// An index into these names.
    Choice(&'static [&'static str]),
}

/// One parameter: the panel, the scene files and the journal are made from this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param {
    /// Stable for ever, not 0, not an index.
    pub id: u32,
    /// What values it takes.
    pub kind: ParamKind,
    /// Shown with a logarithmic slider.
    pub logarithmic: bool,
    /// Least value.
    pub minimum: f64,
    /// Greatest value.
    pub maximum: f64,
    /// Value of a fresh instance.
    pub default: f64,
    /// In scene files: `lower_case_words`.
    pub key: &'static str,
    /// In the panel.
    pub label: &'static str,
    /// Heading in the panel.
    pub group: &'static str,
    /// `"m/s"`; empty without a unit.
    pub unit: &'static str,
    /// One sentence.
    pub help: &'static str,
}

impl Param {
    /// A number: 0 in 0..1 until [`Param::range`] and [`Param::default`] say otherwise.
    pub const fn float(id: u32, key: &'static str) -> Self {
        Self {
            id,
            kind: ParamKind::Float,
            logarithmic: false,
            minimum: 0.0,
            maximum: 1.0,
            default: 0.0,
            key,
            label: key,
            group: "",
            unit: "",
            help: "",
        }
    }

    /// A whole number.
    pub const fn int(id: u32, key: &'static str) -> Self {
        Self { kind: ParamKind::Int, ..Self::float(id, key) }
    }

    /// On or off.
    pub const fn switch(id: u32, key: &'static str) -> Self {
        Self { kind: ParamKind::Switch, ..Self::float(id, key) }
    }

    /// One of several names.
    pub const fn choice(id: u32, key: &'static str, names: &'static [&'static str]) -> Self {
        let maximum = if names.is_empty() { 0.0 } else { (names.len() - 1) as f64 };
        Self { kind: ParamKind::Choice(names), maximum, ..Self::float(id, key) }
    }

    /// Name in the panel.
    pub const fn label(self, label: &'static str) -> Self {
        Self { label, ..self }
    }

    /// Heading in the panel.
    pub const fn group(self, group: &'static str) -> Self {
        Self { group, ..self }
    }

    /// Unit of the value.
    pub const fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Least and greatest value.
    pub const fn range(self, minimum: f64, maximum: f64) -> Self {
        Self { minimum, maximum, ..self }
    }

    /// Value of a fresh instance.
    pub const fn default(self, default: f64) -> Self {
        Self { default, ..self }
    }

    /// One sentence.
    pub const fn help(self, help: &'static str) -> Self {
        Self { help, ..self }
    }

    /// A logarithmic slider in the panel.
    pub const fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }

    /// The nearest value that the parameter may take; None for NaN.
    pub fn nearest(&self, value: f64) -> Option<f64> {
        if value.is_nan() {
            return None;
        }
        let value = value.clamp(self.minimum, self.maximum);
        Some(match self.kind {
            ParamKind::Float => value,
            ParamKind::Int | ParamKind::Choice(_) => value.round(),
            ParamKind::Switch => f64::from(value >= 0.5),
        })
    }

    /// The contract's number of the kind.
    pub(crate) fn kind_code(&self) -> u32 {
        match self.kind {
            ParamKind::Float => abi::PARAM_FLOAT,
            ParamKind::Int => abi::PARAM_INT,
            ParamKind::Switch => abi::PARAM_SWITCH,
            ParamKind::Choice(_) => abi::PARAM_CHOICE,
        }
    }
}

/// Says what is wrong with a table of parameters, if anything is.
pub(crate) fn check_table(params: &[Param]) -> Result<(), String> {
    for (i, param) in params.iter().enumerate() {
        let key = param.key;
        let well_formed = key.starts_with(|c: char| c.is_ascii_lowercase())
            && key.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        if !well_formed {
            return Err(format!("parameter `{key}`: its key must be lower_case_words"));
        }
        if param.id == 0 {
            return Err(format!("parameter `{key}`: its id must not be 0"));
        }
        if let Some(other) = params[..i].iter().find(|p| p.id == param.id || p.key == key) {
            return Err(format!("parameters `{}` and `{key}` share an id or a key", other.key));
        }
        let finite = [param.minimum, param.maximum, param.default].iter().all(|v| v.is_finite());
        if !finite || param.minimum > param.maximum || param.nearest(param.default) != Some(param.default) {
            return Err(format!(
                "parameter `{key}`: its default {} is no value of its range {}..{}",
                param.default, param.minimum, param.maximum
            ));
        }
        if param.logarithmic && param.minimum <= 0.0 {
            return Err(format!("parameter `{key}`: a logarithmic slider needs a range above 0"));
        }
        if matches!(param.kind, ParamKind::Choice([])) {
            return Err(format!("parameter `{key}`: a choice of nothing"));
        }
    }
    Ok(())
}

/// The present values of an instance's parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    table: &'static [Param],
    values: Vec<f64>,
}

impl Params {
    /// All parameters of the table at their defaults.
    pub fn new(table: &'static [Param]) -> Self {
        Self { table, values: table.iter().map(|p| p.default).collect() }
    }

    /// The declarations.
    pub fn table(&self) -> &'static [Param] {
        self.table
    }

    /// The value of parameter `id`; None: there is no such parameter.
    pub fn get(&self, id: u32) -> Option<f64> {
        self.table.iter().zip(&self.values).find(|(p, _)| p.id == id).map(|(_, v)| *v)
    }

    /// Sets parameter `id` to the nearest value that it may take; false: no such parameter, or NaN.
    pub fn set(&mut self, id: u32, value: f64) -> bool {
        let Some(i) = self.table.iter().position(|p| p.id == id) else { return false };
        let Some(value) = self.table[i].nearest(value) else { return false };
        self.values[i] = value;
        true
    }

    /// Id and value of each parameter, in the order of the declarations.
    pub fn iter(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        self.table.iter().zip(&self.values).map(|(p, v)| (p.id, *v))
    }

    /// Takes over all values without allocating; both sides must be of the same table.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.values.clone_from(&other.values);
    }
}
