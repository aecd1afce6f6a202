// Whether a text is one that Prometheus reads: the exposition format 0.0.4, as far as goniod uses it.
#pragma once

#include <string>
#include <string_view>

namespace gonio::soak {

// Result: the first line that is wrong and why; "" where all are right: names, labels, values, a HELP and a TYPE before
// the first sample of each family, no sample twice.
std::string metrics_fault(const std::string& text);

// Result: the value of the sample that begins with `name` (with its labels); -1 where there is none.
double metric_value(const std::string& text, std::string_view name);

}  // namespace gonio::soak
