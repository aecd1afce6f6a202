// Small multiples of x-y plots on logarithmic axes as an SVG file, in light and dark. No library.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace gonio::bench {

struct PlotPoint {
    glm::dvec2 at{1.0};  // both > 0 and finite; others are left out
    std::string label;   // beside the point
};

struct PlotSeries {
    std::string name;  // series of the same name share colour and marker over all panels; at most 6 names
    std::vector<PlotPoint> points;
};

struct PlotPanel {
    std::string title;
    std::vector<PlotSeries> series;
    std::vector<glm::dvec2> front;  // joined by the line of best choices, ascending in x
};

struct Plot {
    std::string title, subtitle, note, x_label, y_label, front_label;  // note: a second line under the title
    std::vector<PlotPanel> panels;
};

// Result: the SVG document. All panels share their axes, which span the points by whole tick marks (1, 2, 5).
std::string plot_svg(const Plot& plot);

}  // namespace gonio::bench
