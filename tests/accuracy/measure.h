// A case's figures as the three qualities read them.
#pragma once

#include <optional>
#include <vector>

#include "server/render/renderer.h"
#include "tests/accuracy/cases.h"

namespace gonio::accuracy {

struct Value {
    double value = 0.0;  // in the case's unit
    double error = 0.0;  // estimated standard error, same unit; 0 where computed without chance
};

// Result: one value per figure, by trace::measure.
std::vector<Value> by_reference(const Case& c);
// Result: one value per figure, by Renderer::meter. Thread of the GL context.
std::vector<Value> by_renderer(Renderer& renderer, const Case& c, Renderer::MeterQuality quality);

// Result: (value - expected) / expected; where nothing is expected, the value relative to the case's largest figure.
double relative_difference(const Case& c, const Figure& figure, double value);

}  // namespace gonio::accuracy
