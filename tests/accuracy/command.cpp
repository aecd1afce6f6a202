#include "tests/accuracy/command.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "server/gl/context.h"
#include "tests/accuracy/crosscheck.h"
#include "tests/accuracy/exported.h"
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

struct CrossOptions {
    std::string directory, markdown;
    bool prepare = false;
};

void run_crosscheck(const CrossOptions& options) {
    if (options.prepare) {
        for (const std::string& name : write_cross_scenes(options.directory)) std::cout << name << "\n";
        return;
    }
    const auto context = gl::Context::create({-1, false});
    const std::vector<CrossRow> rows = compare_with_cycles(*context, options.directory);
    const std::string table = cross_markdown(rows);
    std::cout << table;
    if (!options.markdown.empty()) replace_between_markers(options.markdown, "cycles", table);
    for (const CrossRow& row : rows) {
        const double difference = std::max(std::abs(row.reference / row.cycles - 1), row.worst_channel);
        if (!(difference <= kCrossTolerance && row.reference_blocks <= kCrossBlocks))
            throw std::runtime_error(row.run + ", " + row.part + ": the reference differs from Cycles by " +
                                     std::to_string(100 * difference) + " %, its blocks by " +
                                     std::to_string(100 * row.reference_blocks) + " %");
    }
}

void run_exported(const CrossOptions& options) {
    const auto context = gl::Context::create({-1, false});
    const std::vector<ExportRow> rows = compare_export(*context, options.directory);
    const std::string table = export_markdown(rows);
    std::cout << table;
    if (!options.markdown.empty()) replace_between_markers(options.markdown, "export", table);
    for (const ExportRow& row : rows) {
        if (!row.good()) throw std::runtime_error("\"" + row.group + "\" differs by more than is allowed");
    }
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

    auto cross = std::make_shared<CrossOptions>();
    CLI::App* crosscheck = app.add_subcommand("crosscheck", "pictures of cornell against those of Blender's Cycles");
    crosscheck->add_option("directory", cross->directory, "where the scenes and Cycles' pictures are")
        ->required()
        ->check(CLI::ExistingDirectory);
    crosscheck->add_flag("--prepare", cross->prepare, "only write the scenes; print their names");
    crosscheck->add_option("--markdown", cross->markdown, "also write the table into this file, between its markers");
    crosscheck->callback([cross] { run_crosscheck(*cross); });

    auto exported = std::make_shared<CrossOptions>();
    CLI::App* room = app.add_subcommand("exported", "a room of Blender's exporter against what Cycles measures in it");
    room->add_option("directory", exported->directory, "where room.glb and expected.json are")
        ->required()
        ->check(CLI::ExistingDirectory);
    room->add_option("--markdown", exported->markdown, "also write the table into this file, between its markers");
    room->callback([exported] { run_exported(*exported); });
}

}  // namespace gonio::accuracy
