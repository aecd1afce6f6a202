// The accuracy table: every case in every quality, as Markdown and as JSON. The same build on the same GL prints the
// same bytes each time.
#pragma once

#include <string>
#include <vector>

#include "tests/accuracy/measure.h"

namespace gonio::accuracy {

struct Row {
    const Case* c = nullptr;
    std::vector<Value> reference, rsm, interactive;  // one per figure; rsm and interactive empty without a GL
};

// Result: the cases whose id starts with `prefix`, measured. context: null where there is no EGL.
std::vector<Row> measure_cases(const gl::Context* context, const std::string& prefix);

// Result: a summary with one line per case, then one line per figure.
std::string markdown_table(const std::vector<Row>& rows);
// Result: {"rows": [{"id","title","unit","figures":[{"name","expected","reference","reference_error","rsm",…}]}]}
std::string json_table(const std::vector<Row>& rows);

// Replaces what stands between the lines "<!-- NAME: begin … -->" and "<!-- NAME: end -->" of a file.
// Throws std::runtime_error, one sentence, where the file or a marker is missing.
void replace_between_markers(const std::string& path, const std::string& name, const std::string& text);

// Result: with its sign and two decimals, "+0.42 %".
std::string percent(double ratio);

}  // namespace gonio::accuracy
