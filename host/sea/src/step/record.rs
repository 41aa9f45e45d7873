//! Recordings: where everything was, as CSV that any program reads.
//!
//! Columns `step,time,plugin,stream,object,node,x,y,z,radius`: metres, seconds, y up, still water at y = 0,
//! twelve significant digits. Step 0 is the state before the first step. Objects keep their numbers; one that
//! is gone (a fibre that broke off, say) has no more rows.

use std::io::{self, Write};

use super::world::World;

/// The first line.
pub const COLUMNS: &str = "step,time,plugin,stream,object,node,x,y,z,radius";
/// Name of the host in the column `plugin`.
pub const HOST: &str = "host";
/// Name of the sea's flow in the column `stream`; the others are named by the plugins.
pub const FLOW: &str = "flow";

/// What is recorded; an empty list takes everything.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// Ids of plugins, or names of modules.
    pub plugins: Vec<String>,
    /// Names of streams.
    pub streams: Vec<String>,
    /// Numbers of objects.
    pub objects: Vec<u64>,
}

impl Filter {
    fn plugin(&self, id: &str, module: &str) -> bool {
        self.plugins.is_empty() || self.plugins.iter().any(|name| name == id || name == module)
    }

    fn row(&self, stream: &str, object: u64) -> bool {
        (self.streams.is_empty() || self.streams.iter().any(|name| name == stream))
            && (self.objects.is_empty() || self.objects.contains(&object))
    }
}

/// Writes the world's present step. The world must have been made with traces. Modules that share a plugin
/// are told apart as `plugin/module`.
pub fn write(world: &World, filter: &Filter, out: &mut impl Write) -> io::Result<()> {
    let frame = world.frame();
    let mut start = Vec::new();
    let mut line = Vec::new();
    write!(start, "{},{}", frame.step, digits(frame.time))?;
    let ids: Vec<&str> = world.modules().map(|(_, info)| info.id.as_str()).collect();
    for ((name, info), outputs) in world.modules().zip(&frame.outputs) {
        if !filter.plugin(&info.id, name) {
            continue;
        }
        let shared = ids.iter().filter(|id| **id == info.id).count() > 1;
        let plugin = if shared { format!("{}/{name}", info.id) } else { info.id.clone() };
        for point in &outputs.trace {
            // Every trace has a kind that its plugin names: the step was looked at.
            let stream = info.traces.get(point.kind as usize).map_or("", String::as_str);
            if filter.row(stream, point.object) {
                line.clear();
                let [x, y, z] = point.position.map(digits);
                let (object, node, radius) = (point.object, point.node, digits(point.radius.into()));
                line.extend_from_slice(&start);
                writeln!(line, ",{plugin},{stream},{object},{node},{x},{y},{z},{radius}")?;
                out.write_all(&line)?;
            }
        }
    }
    if filter.plugin(HOST, HOST) {
        for (object, flow) in frame.flow.iter().enumerate() {
            if filter.row(FLOW, object as u64) {
                line.clear();
                let [x, y, z] = flow.position.map(digits);
                line.extend_from_slice(&start);
                writeln!(line, ",{HOST},{FLOW},{object},0,{x},{y},{z},{}", digits(flow.strength.into()))?;
                out.write_all(&line)?;
            }
        }
    }
    Ok(())
}

/// A number with twelve significant digits and no more than it needs, never in exponents.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { value.to_string() };
    }
    // Rounded in decimal, then written as the shortest text of that decimal.
    let rounded = format!("{value:.11e}").parse::<f64>().unwrap_or(value);
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_twelve_significant_digits_and_no_exponent() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (1.0, "1"),
            (1.0 / 3.0, "0.333333333333"),
            (20_000.0 / 3.0, "6666.66666667"),
            (-1e-9 / 3.0, "-0.000000000333333333333"),
            (123_456_789_012_345.0, "123456789012000"),
            (f64::from(0.1_f32), "0.10000000149"),
        ] {
            assert_eq!(digits(value), text);
            let back: f64 = text.parse().unwrap();
            assert!((back - value).abs() <= value.abs() * 5e-12, "{value}");
        }
    }

    #[test]
    fn filters_take_what_they_name_and_everything_when_empty() {
        let all = Filter::default();
        assert!(all.plugin("reef.anemone", "garden") && all.row("fibre", 7));
        let some =
            Filter { plugins: vec!["garden".into()], streams: vec!["fibre".into()], objects: vec![3, 4] };
        assert!(some.plugin("reef.anemone", "garden") && !some.plugin("reef.anemone", "other"));
        assert!(some.row("fibre", 4) && !some.row("fibre", 5) && !some.row("flow", 4));
    }
}
