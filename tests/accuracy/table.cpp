#include "tests/accuracy/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

namespace gonio::accuracy {
namespace {

// Four significant digits: enough to compare, few enough to be the same on the next machine.
std::string number(double value) {
    if (std::abs(value) < 5e-7) return "0";
    char text[32];
    const int digits = std::clamp(3 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 6);
    std::snprintf(text, sizeof text, "%.*f", digits, value);
    return text;
}

// The largest difference of a case, signed.
std::string worst(const Case& c, const std::vector<Value>& values) {
    if (values.empty()) return "–";
    double result = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
        const double difference = relative_difference(c, c.figures[i], values[i].value);
        if (std::abs(difference) > std::abs(result)) result = difference;
    }
    return percent(result);
}

std::string met(const std::optional<double>& tolerance, const std::string& difference) {
    return tolerance ? difference : "(" + difference + ")";
}

std::string cells(const Case& c, std::size_t i, const std::vector<Value>& values) {
    if (values.empty()) return " – | – |";
    return " " + number(values[i].value) + " | " + percent(relative_difference(c, c.figures[i], values[i].value)) +
           " |";
}

}  // namespace

std::string percent(double ratio) {
    char text[32];
    std::snprintf(text, sizeof text, "%+.2f %%", 100 * ratio);
    return std::string(text) == "-0.00 %" ? "+0.00 %" : text;
}

std::vector<Row> measure_cases(const gl::Context* context, const std::string& prefix) {
    std::vector<Row> rows;
    for (const Case& c : cases()) {
        if (c.id.rfind(prefix, 0) != 0) continue;
        Row row{&c, by_reference(c), {}, {}};
        if (context) {
            // A renderer of its own: scenes that were made alike share revisions, so one renderer would keep the last.
            Renderer renderer(*context);
            row.rsm = by_renderer(renderer, c, Renderer::MeterQuality::rsm);
            row.interactive = by_renderer(renderer, c, Renderer::MeterQuality::interactive);
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

std::string markdown_table(const std::vector<Row>& rows) {
    std::ostringstream out;
    out << "Largest difference of each case; in brackets: outside what the quality models.\n\n"
        << "| case | what | reference | rsm | interactive | what is left out |\n|---|---|---|---|---|---|\n";
    for (const Row& row : rows) {
        const Case& c = *row.c;
        out << "| " << c.id << " | " << c.title << " | " << worst(c, row.reference) << " | "
            << met(c.rsm_tolerance, worst(c, row.rsm)) << " | "
            << met(c.interactive_tolerance, worst(c, row.interactive)) << " | " << c.limit << " |\n";
    }
    out << "\nEvery figure:\n\n| case | figure | unit | expected | reference | ± | difference | rsm | difference | "
           "interactive | difference |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const Row& row : rows) {
        const Case& c = *row.c;
        for (std::size_t i = 0; i < c.figures.size(); ++i) {
            out << "| " << c.id << " | " << c.figures[i].name << " | " << c.unit << " | "
                << number(c.figures[i].expected) << " | " << number(row.reference[i].value) << " | "
                << number(row.reference[i].error) << " | "
                << percent(relative_difference(c, c.figures[i], row.reference[i].value)) << " |" << cells(c, i, row.rsm)
                << cells(c, i, row.interactive) << "\n";
        }
    }
    return out.str();
}

std::string json_table(const std::vector<Row>& rows) {
    nlohmann::json json = {{"rows", nlohmann::json::array()}};
    for (const Row& row : rows) {
        nlohmann::json figures = nlohmann::json::array();
        for (std::size_t i = 0; i < row.c->figures.size(); ++i) {
            nlohmann::json figure = {{"name", row.c->figures[i].name},
                                     {"expected", row.c->figures[i].expected},
                                     {"reference", row.reference[i].value},
                                     {"reference_error", row.reference[i].error}};
            if (!row.rsm.empty()) figure["rsm"] = row.rsm[i].value;
            if (!row.interactive.empty()) figure["interactive"] = row.interactive[i].value;
            figures.push_back(std::move(figure));
        }
        json["rows"].push_back({{"id", row.c->id},
                                {"title", row.c->title},
                                {"unit", row.c->unit},
                                {"limit", row.c->limit},
                                {"figures", std::move(figures)}});
    }
    return json.dump(2) + "\n";
}

void replace_between_markers(const std::string& path, const std::string& name, const std::string& text) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error("cannot read " + path);
    std::string begin_line, end_line, before, after, line;
    const std::string begin = "<!-- " + name + ": begin", end = "<!-- " + name + ": end";
    while (std::getline(in, line)) {
        if (line.rfind(begin, 0) == 0) begin_line = line + "\n";
        if (line.rfind(end, 0) == 0) end_line = line + "\n";
        if (begin_line.empty()) {
            before += line + "\n";
        } else if (!end_line.empty() && line + "\n" != end_line) {
            after += line + "\n";
        }
    }
    in.close();
    if (begin_line.empty() || end_line.empty())
        throw std::runtime_error(path + " has no lines \"" + begin + " …\" and \"" + end + " -->\"");
    std::ofstream out(path, std::ios::trunc);
    out << before << begin_line << "\n" << text << "\n" << end_line << after;
    if (!out.flush()) throw std::runtime_error("cannot write " + path);
}

}  // namespace gonio::accuracy
