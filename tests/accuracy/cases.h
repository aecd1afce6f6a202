// Scenes whose light is known in closed form, as data: what to measure where, and what it must read.
#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/scene.h"
#include "server/trace/reference.h"

namespace gonio::accuracy {

enum class Part : std::uint8_t { direct, indirect, total };

// One place and its share in a figure.
struct Sample {
    glm::dvec3 position{0.0};    // world, m
    glm::dvec3 normal{0, 1, 0};  // unit
    double weight = 1.0;         // of the reading in lx: 1 for lx, an area in m² for lm, 100 / (E rho) for percent
};

// A number that is compared: the weighted sum over its samples.
struct Figure {
    std::string name;  // the point's letter or place
    std::vector<Sample> samples;
    double expected = 0.0;  // in the case's unit
};

struct Case {
    std::string id;     // "cie-5.2", unique, file-name characters
    std::string title;  // one line
    std::string unit;   // "lx", "lm", "%", "1"
    Scene scene;
    trace::Settings settings;  // for the reference quality
    Part part = Part::total;
    std::vector<Figure> figures;
    // Largest relative difference allowed. An empty one: that quality's model cannot meet the case, see `limit`;
    // its figures are shown all the same.
    double reference_tolerance = 0.01;
    std::optional<double> rsm_tolerance, interactive_tolerance;
    bool variant =
        false;          // of another case, in a number or a turn: ./dev accuracy measures it, the default tests do not
    std::string limit;  // what the real-time model leaves out here; empty where it leaves out nothing
};

// Result: all cases, in the order of the table; built once. Any thread.
const std::vector<Case>& cases();

// The lists they are put together from.
std::vector<Case> cie171_cases();
std::vector<Case> source_cases();
std::vector<Case> room_cases();

}  // namespace gonio::accuracy
