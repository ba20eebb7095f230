//! Which command helps where the libraries say what they lack.

use mrt_runtime::AssembleError;

/// What to add to the message of an error of assembly: the command or flag that mends it, or nothing.
pub(crate) fn after_assembly(error: &AssembleError) -> &'static str {
    match error {
        AssembleError::MissingVariant { .. } => " (`mrt adapt` makes such a dictionary)",
        AssembleError::MissingPath { .. } => " (`mrt pack` makes such a dictionary)",
        AssembleError::MissingLightfields => {
            " (`mrt pack` keeps them unless `--coupling table` leaves them out)"
        }
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_command_that_mends_it() {
        let error = AssembleError::MissingVariant {
            block: 0,
            shape: "tee",
            transport: "rebuilt",
        };
        assert!(after_assembly(&error).contains("mrt adapt"));
        assert_eq!(after_assembly(&AssembleError::Depth { found: 99 }), "");
    }
}
