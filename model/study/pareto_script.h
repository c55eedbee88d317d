#pragma once

namespace degas {

/// Style element of the report, beyond html.h's.
extern const char* const pareto_style;
/// Its script, without dependencies: hover and click on what has data-point, another device's speed, marked rows.
extern const char* const pareto_script;

}  // namespace degas
