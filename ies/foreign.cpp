#include "ies/foreign.h"

#include <algorithm>
#include <string>

#include "ies/core/text.h"
#include "ies/text_encoding.h"
#include "ies/text_scan.h"
#include "ies/xml_text.h"

namespace gonio::ies::detail {

namespace {

constexpr std::size_t kLooked_bytes = 4096;
constexpr std::size_t kShown = 60;  // characters of a file's own text in an error
constexpr const char* kAskFor = "ask its maker for the photometric file (.ies, .ldt, .xml or .gldf)";

struct Signature {
    std::string_view begin;
    const char* name;
};
using namespace std::string_view_literals;
constexpr Signature kSignatures[] = {
    {"%PDF-"sv, "a PDF document"},
    {"%!PS"sv, "a PostScript document"},
    {"{\\rtf"sv, "a text document (RTF)"},
    {"\xd0\xcf\x11\xe0"sv, "a document of an old office program"},
    {"\x89PNG"sv, "a picture (PNG)"},
    {"\xff\xd8\xff"sv, "a picture (JPEG)"},
    {"GIF8"sv, "a picture (GIF)"},
    {"II*\0"sv, "a picture (TIFF)"},
    {"MM\0*"sv, "a picture (TIFF)"},
    {"v/1\x01"sv, "a picture (OpenEXR)"},
    {"RIFF"sv, "a picture, a sound or a film (RIFF)"},
    {"\x1f\x8b"sv, "packed by gzip; unpack it first"},
    {"BZh"sv, "packed by bzip2; unpack it first"},
    {"\xfd\x37zXZ"sv, "packed by xz; unpack it first"},
    {"7z\xbc\xaf"sv, "an archive (7z); unpack it first"},
    {"Rar!"sv, "an archive (RAR); unpack it first"},
    {"MZ"sv, "a program for Windows"},
    {"\x7f"
     "ELF"sv,
     "a program for Linux"},
    {"AC10"sv, "a drawing (DWG)"},
    {"glTF"sv, "a scene (GLB)"},
    {"SQLite format 3"sv, "a database (SQLite)"},
};

bool is_same_letter(char a, char b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return lower(a) == lower(b);
}

std::size_t find_word(std::string_view text, std::string_view word) {
    const auto at = std::ranges::search(text, word, is_same_letter).begin();
    return at == text.end() ? std::string_view::npos : static_cast<std::size_t>(at - text.begin());
}

// What stands between <title> and the next tag: a server's page says there what went wrong.
std::string title_of(std::string_view page) {
    const std::size_t at = find_word(page, "<title>");
    if (at == std::string_view::npos) return {};
    const std::string_view rest = page.substr(at + 7);
    return shown_text(trim(rest.substr(0, rest.find('<'))), kShown);
}

bool is_page(std::string_view text) {
    return find_word(text.substr(0, 9), "<!doctype") == 0
               ? find_word(text.substr(0, 64), "html") != std::string_view::npos
               : find_word(text, "<html") != std::string_view::npos;
}

// "<svg width=…" -> "svg"; behind the declaration, comments and the document type.
std::string_view root_of(std::string_view text) {
    for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', at + 1)) {
        const std::string_view tag = text.substr(at + 1);
        if (tag.empty() || tag.front() == '?' || tag.front() == '!') continue;
        return tag.substr(0, tag.find_first_of(" \t\r\n/>"));
    }
    return {};
}

const char* known_root(std::string_view root) {
    constexpr Signature kRoots[] = {
        {"GDTF", "the description of a GDTF fixture, without its archive"},
        {"GeneralSceneDescription", "the description of an MVR show, without its archive"},
        {"Root", "the product.xml of a GLDF file, without its archive"},
        {"svg", "a drawing (SVG)"},
        {"COLLADA", "a model (COLLADA)"},
    };
    const auto* const found = std::ranges::find(kRoots, root, &Signature::begin);
    return found == std::end(kRoots) ? nullptr : found->name;
}

// Bytes that no text has, but a zero byte of UTF-16 and the end mark of old systems.
bool is_binary(std::string_view head) {
    const auto odd = std::ranges::count_if(head, [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return byte < 0x20 && byte != '\t' && byte != '\n' && byte != '\r' && byte != '\f' && byte != 0x1a;
    });
    return odd > 0 && static_cast<std::size_t>(odd) * 16 >= head.size();
}

Error named(std::string_view value, std::string message) {
    return {"not_photometry", "line 1 column 1", std::string(value), std::move(message)};
}

}  // namespace

std::optional<Error> foreign_file(std::string_view bytes) {
    const std::string_view head = bytes.substr(0, kLooked_bytes);
    for (const Signature& signature : kSignatures) {
        if (!head.starts_with(signature.begin)) continue;
        // Two letters may begin a text as well.
        if (signature.begin.size() < 4 && !is_binary(head) && signature.begin[0] != '\x1f') continue;
        return named({}, std::string("the file is ") + signature.name + ", no photometric file");
    }
    const std::string decoded = decode_utf16(head);
    const std::string_view text = trim(decoded.empty() ? without_mark(head) : std::string_view(decoded));
    if (decoded.empty() && is_binary(head)) {
        const bool uld = head.substr(0, 64).find("ULD") != std::string_view::npos;
        return named({}, std::string("the file is ") +
                             (uld ? "a maker's plugin luminaire (ULD), which DIALux alone reads; "
                                  : "binary, no text, as a plugin's luminaire (.uld, .rolf) is; ") +
                             kAskFor);
    }
    if (is_page(text)) {
        return named(title_of(text),
                     "the file is a web page (HTML), as a server sends where a download fails; fetch "
                     "the photometric file again");
    }
    if (text.starts_with('<')) {
        const std::string_view root = root_of(text);
        const char* const known = known_root(root);
        if (known != nullptr) return named(root, std::string("the file is ") + known);
        if (looks_like_xml(bytes)) return std::nullopt;  // read_tm33 says what is wrong with it
        return named(shown_text(root, kShown), "the file is XML of another kind than TM-33");
    }
    if (text.starts_with('{') && text.find('"') != std::string_view::npos) {
        const bool gltf = text.find("\"asset\"") != std::string_view::npos;
        return named(
            {}, gltf ? "the file is a scene (glTF), no photometric file" : "the file is JSON, no photometric file");
    }
    return std::nullopt;
}

}  // namespace gonio::ies::detail
