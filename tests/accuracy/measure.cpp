#include "tests/accuracy/measure.h"

#include <algorithm>
#include <cmath>

namespace gonio::accuracy {
namespace {

double photopic(const glm::dvec3& rgb) {
    return glm::dot(rgb, glm::dvec3(0.2126, 0.7152, 0.0722));
}

bool counts(Part wanted, Part part) {
    return wanted == Part::total || wanted == part;
}

}  // namespace

std::vector<Value> by_reference(const Case& c) {
    std::vector<trace::MeterPoint> points;
    for (const Figure& figure : c.figures) {
        for (const Sample& sample : figure.samples) points.push_back({sample.position, sample.normal});
    }
    const auto readings = trace::measure(*trace::make_world(c.scene), points, c.settings);
    std::vector<Value> values;
    std::size_t next = 0;
    for (const Figure& figure : c.figures) {
        Value sum;
        double variance = 0.0;
        for (const Sample& sample : figure.samples) {
            const trace::Reading& reading = readings.at(next++);
            if (counts(c.part, Part::direct)) {
                sum.value += sample.weight * photopic(reading.direct_lx);
                variance += std::pow(sample.weight * reading.direct_error_lx, 2.0);
            }
            if (counts(c.part, Part::indirect)) {
                sum.value += sample.weight * photopic(reading.indirect_lx);
                variance += std::pow(sample.weight * reading.indirect_error_lx, 2.0);
            }
        }
        sum.error = std::sqrt(variance);
        values.push_back(sum);
    }
    return values;
}

std::vector<Value> by_renderer(Renderer& renderer, const Case& c, Renderer::MeterQuality quality) {
    std::vector<Value> values;
    for (const Figure& figure : c.figures) {
        Value sum;
        for (const Sample& sample : figure.samples) {
            const auto reading = renderer.meter(c.scene, sample.position, sample.normal, quality, c.settings.bounces);
            if (counts(c.part, Part::direct)) sum.value += sample.weight * reading.direct_lx();
            if (counts(c.part, Part::indirect)) sum.value += sample.weight * reading.indirect_lx();
        }
        values.push_back(sum);
    }
    return values;
}

double relative_difference(const Case& c, const Figure& figure, double value) {
    double scale = figure.expected;
    if (scale == 0.0) {
        for (const Figure& other : c.figures) scale = std::max(scale, other.expected);
    }
    return (value - figure.expected) / scale;
}

}  // namespace gonio::accuracy
