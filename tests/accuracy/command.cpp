#include "tests/accuracy/command.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/gl/context.h"
#include "tests/accuracy/table.h"

namespace gonio::accuracy {
namespace {

struct Options {
    std::string markdown, prefix;
    bool json = false;
    int device = -1;
};

void run(const Options& options) {
    std::unique_ptr<gl::Context> context;
    try {
        context = gl::Context::create({options.device, false});
    } catch (const std::runtime_error& error) {
        std::cerr << "without the real-time qualities: " << error.what() << "\n";
    }
    const std::vector<Row> rows = measure_cases(context.get(), options.prefix);
    const std::string table = markdown_table(rows);
    std::cout << (options.json ? json_table(rows) : table);
    if (!options.markdown.empty()) replace_between_markers(options.markdown, "accuracy", table);
}

}  // namespace

void add_commands(CLI::App& app) {
    auto options = std::make_shared<Options>();
    CLI::App* command = app.add_subcommand("accuracy", "every quality against closed forms: CIE 171, sources, rooms");
    command->add_option("--markdown", options->markdown, "also write the table into this file, between its markers");
    command->add_option("--case", options->prefix, "only cases whose name starts so");
    command->add_option("--device", options->device, "index of the EGL device");
    command->add_flag("--json", options->json, "print JSON");
    command->callback([options] { run(*options); });
}

}  // namespace gonio::accuracy
