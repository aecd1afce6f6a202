// Archives that are built byte by byte here (APPNOTE 6.3), so that each can be wrong in one way; and those that
// write_zip writes.
#include "ies/core/zip.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>

namespace gonio {
namespace {

// CRC-32 of ISO 3309, bit by bit.
std::uint32_t crc_of(std::string_view bytes) {
    std::uint32_t crc = 0xFFFFFFFFu;
    for (const char c : bytes) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0u);
    }
    return ~crc;
}

// A stored file, and what its headers say of it.
struct Stored {
    std::string name;
    std::string bytes = "some text";
    std::uint16_t flags = 0;
    std::uint16_t method = 0;
    std::uint32_t wrong_crc = 0;
    std::uint32_t more_bytes = 0;  // that the headers declare
};

std::string number(std::uint32_t value, int bytes) {
    std::string result;
    for (int i = 0; i < bytes; ++i) result.push_back(static_cast<char>(value >> 8 * i & 0xFF));
    return result;
}

std::string archive_of(const std::vector<Stored>& files) {
    std::string result;
    std::string directory;
    for (const Stored& file : files) {
        const auto size = static_cast<std::uint32_t>(file.bytes.size());
        const std::string facts = number(20, 2) + number(file.flags, 2) + number(file.method, 2) + number(0, 2) +
                                  number(0x21, 2) + number(crc_of(file.bytes) ^ file.wrong_crc, 4) + number(size, 4) +
                                  number(size + file.more_bytes, 4) +
                                  number(static_cast<std::uint32_t>(file.name.size()), 2) + number(0, 2);
        directory += "PK\x01\x02" + number(20, 2) + facts + number(0, 2) + number(0, 2) + number(0, 2) + number(0, 4) +
                     number(static_cast<std::uint32_t>(result.size()), 4) + file.name;
        result += "PK\x03\x04" + facts + file.name + file.bytes;
    }
    const auto count = static_cast<std::uint32_t>(files.size());
    return result + directory + "PK\x05\x06" + number(0, 4) + number(count, 2) + number(count, 2) +
           number(static_cast<std::uint32_t>(directory.size()), 4) +
           number(static_cast<std::uint32_t>(result.size()), 4) + number(0, 2);
}

std::string refusal_of(const std::vector<Stored>& files, const ZipLimits& limits = {}) {
    const auto archive = open_zip(archive_of(files), limits);
    return archive ? "" : archive.error().code + " " + archive.error().where;
}

std::string read_refusal(const std::vector<Stored>& files, const ZipLimits& limits = {}) {
    const auto archive = open_zip(archive_of(files), limits);
    if (!archive) return archive.error().text();
    const auto bytes = archive->read(files.front().name);
    return bytes ? "" : bytes.error().code + " " + bytes.error().where;
}

TEST(Zip, EntriesAreListedAndRead) {
    EXPECT_EQ(crc_of("123456789"), 0xCBF43926u);  // the check value that every table of CRCs has
    const auto archive = open_zip(archive_of({{"a/", ""}, {"a/one.txt", "first"}, {"./a//two.txt", "second"}}));
    ASSERT_TRUE(archive) << archive.error().text();
    ASSERT_EQ(archive->entries().size(), 3u);
    EXPECT_TRUE(archive->entries()[0].is_folder());
    EXPECT_EQ(archive->entries()[1].name, "a/one.txt");
    EXPECT_EQ(archive->entries()[1].bytes, 5u);
    EXPECT_EQ(archive->entries()[2].name, "a/two.txt");
    EXPECT_EQ(archive->entries()[2].raw_name, "./a//two.txt");
    EXPECT_EQ(archive->read("a/two.txt").value(), "second");
    EXPECT_EQ(archive->read("a/one.txt").value(), "first");
    EXPECT_EQ(archive->read("a/one.txt").value(), "first") << "again";
    EXPECT_EQ(archive->read("a/").error().code, "zip_no_such_entry");
    EXPECT_EQ(archive->read("A/one.txt").error().code, "zip_no_such_entry");
}

TEST(Zip, NamesThatLeadOutAreRefused) {
    for (const char* name : {"/etc/passwd", "../x", "a/../../x", "a/..", "..\\x", "a\\..\\x", "\\x", "C:\\x", "c:x",
                             "a\nb", "a\1b", "\x7F", "a\tb", "", ".", "//x"})
        EXPECT_TRUE(refusal_of({{name}}).starts_with("zip_bad_name")) << name << ": " << refusal_of({{name}});
    EXPECT_TRUE(refusal_of({{std::string(1025, 'n')}}).starts_with("zip_bad_name"));
    EXPECT_NE(refusal_of({{"a\1b", "x", 0x800}}), "") << "in UTF-8 too";
    EXPECT_EQ(refusal_of({{"a..b/..c"}}), "");
    const auto backslash = open_zip(archive_of({{"ldc\\a.ldt"}}));
    ASSERT_TRUE(backslash);
    EXPECT_EQ(backslash->entries()[0].name, "ldc/a.ldt");
}

TEST(Zip, NamesAreUnique) {
    EXPECT_EQ(refusal_of({{"a/b"}, {"c"}, {"a/b"}}), "zip_duplicate_name a/b");
    EXPECT_EQ(refusal_of({{"a/b"}, {"a\\b"}}), "zip_duplicate_name a/b");
    EXPECT_EQ(refusal_of({{"a"}, {"a/", ""}}), "zip_duplicate_name a/");
    const auto clash = open_zip(archive_of({{"a.obj"}, {"A.OBJ"}, {"b"}}));
    ASSERT_TRUE(clash);
    EXPECT_EQ(clash->case_clashes(), std::vector<std::string>{"A.OBJ"});
}

TEST(Zip, NamesWithoutUtf8AreOfCodePage437) {
    const auto archive = open_zip(archive_of({{"\x84\x94\x81.ldt"}}));
    ASSERT_TRUE(archive);
    EXPECT_EQ(archive->entries()[0].name, "äöü.ldt");
    EXPECT_EQ(archive->entries()[0].raw_name, "\x84\x94\x81.ldt");
    const auto utf8 = open_zip(archive_of({{"äöü.ldt", "x", 0x800}}));
    ASSERT_TRUE(utf8);
    EXPECT_EQ(utf8->entries()[0].name, "äöü.ldt");
}

TEST(Zip, LimitsOfTheArchive) {
    const std::vector<Stored> files = {{"a", "0123456789"}, {"b", "0123456789"}};
    EXPECT_EQ(refusal_of(files, {.archive_bytes = archive_of(files).size()}), "");
    EXPECT_EQ(refusal_of(files, {.archive_bytes = archive_of(files).size() - 1}), "zip_too_large zip archive");
    EXPECT_EQ(refusal_of(files, {.entries = 2}), "");
    EXPECT_EQ(refusal_of(files, {.entries = 1}), "zip_too_many_entries zip archive");
    EXPECT_EQ(refusal_of(files, {.total_bytes = 20}), "");
    EXPECT_EQ(refusal_of(files, {.total_bytes = 19}), "zip_total_too_large b");
}

TEST(Zip, OverlappingEntriesAreRefused) {
    // Both entries of the directory tell of the same local file: how an archive of some kilobytes holds petabytes.
    std::string bytes = archive_of({{"a", std::string(100, 'x')}, {"b", ""}});
    const std::size_t second = bytes.rfind("PK\x01\x02");
    bytes.replace(second + 16, 12, bytes.substr(bytes.find("PK\x01\x02") + 16, 12));
    bytes.replace(second + 20, 4, number(250, 4));
    const auto archive = open_zip(bytes);
    ASSERT_FALSE(archive);
    EXPECT_EQ(archive.error().code + " " + archive.error().where, "zip_overlap b");
}

TEST(Zip, DirectoryOfMillionsIsRefusedBeforeItIsRead) {
    std::string bytes = archive_of({{"a"}});
    const std::string entry = bytes.substr(bytes.find("PK\x01\x02"), 47);
    std::string many;
    for (int i = 0; i < 200'000; ++i) many += entry;
    bytes.insert(bytes.rfind("PK\x05\x06"), many);
    EXPECT_EQ(open_zip(bytes).error().code, "zip_too_many_entries");
}

TEST(Zip, WhatCannotBeReadIsNamed) {
    EXPECT_EQ(read_refusal({{"a.txt"}}), "");
    EXPECT_EQ(read_refusal({{"a.txt", "text", 0, 0, 1}}), "zip_crc a.txt");
    EXPECT_EQ(read_refusal({{"a.txt", "text", 1}}), "zip_encrypted a.txt");
    EXPECT_EQ(read_refusal({{"a.txt", "text", 0, 98}}), "zip_method a.txt");
    EXPECT_EQ(read_refusal({{"a.txt", "no deflate", 0, 8}}), "zip_damaged a.txt");
    EXPECT_EQ(read_refusal({{"a.txt", "text", 0, 0, 0, 3}}), "zip_damaged a.txt") << "declared too large";
    EXPECT_EQ(read_refusal({{"a.txt", "text", 0, 0, 0, 0xFFFFFFFFu}}), "zip_damaged a.txt") << "declared one too small";
    EXPECT_EQ(read_refusal({{"a.txt", "12345"}}, {.entry_bytes = 5}), "");
    EXPECT_EQ(read_refusal({{"a.txt", "12345"}}, {.entry_bytes = 4}), "zip_entry_too_large a.txt");
}

TEST(Zip, BombsAreRefused) {
    const std::string zeros(2u << 20, '\0');
    const std::array<ZipFile, 1> files = {{{"bomb", zeros}}};
    const auto bytes = write_zip(files);
    ASSERT_TRUE(bytes) << bytes.error().text();
    EXPECT_LT(bytes->size(), zeros.size() / 500);
    const auto archive = open_zip(*bytes);
    ASSERT_TRUE(archive);
    EXPECT_EQ(archive->read("bomb").error().code, "zip_ratio");
    EXPECT_EQ(open_zip(*bytes, {.ratio = 1100})->read("bomb").value(), zeros);
    EXPECT_EQ(open_zip(*bytes, {.any_ratio_bytes = 2u << 20})->read("bomb").value(), zeros);
}

TEST(Zip, NoArchives) {
    for (const std::string bytes : {"", "PK", "IESNA:LM-63-2002\nTILT=NONE\n"})
        EXPECT_EQ(open_zip(bytes).error().code, "not_a_zip") << bytes;
    const std::string whole = archive_of({{"a", "text"}, {"b", "text"}});
    for (std::size_t size = 1; size < whole.size(); ++size) EXPECT_FALSE(open_zip(whole.substr(0, size))) << size;
    EXPECT_FALSE(looks_like_zip("PK"));
    EXPECT_TRUE(looks_like_zip(whole));
}

TEST(Zip, WritesTheSameBytesEachTime) {
    const std::array<ZipFile, 3> files = {
        {{"GeneralSceneDescription.xml", std::string(5000, '<')}, {"a/äöü.gdtf", "stored", false}, {"empty", ""}}};
    const auto bytes = write_zip(files);
    ASSERT_TRUE(bytes) << bytes.error().text();
    EXPECT_EQ(*bytes, *write_zip(files));
    EXPECT_LT(bytes->size(), 600u);
    EXPECT_NE(bytes->find("stored"), std::string::npos);
    EXPECT_EQ(bytes->substr(10, 4), number(0x00210000, 4)) << "midnight of 1980-01-01 in MS-DOS's form";
    const auto archive = open_zip(*bytes);
    ASSERT_TRUE(archive) << archive.error().text();
    ASSERT_EQ(archive->entries().size(), files.size());
    for (std::size_t i = 0; i < files.size(); ++i) {
        EXPECT_EQ(archive->entries()[i].name, files[i].name);
        EXPECT_EQ(archive->read(files[i].name).value(), files[i].bytes);
    }
    const auto none = write_zip({});
    ASSERT_TRUE(none);
    EXPECT_TRUE(open_zip(*none)->entries().empty());
}

TEST(Zip, WritesNoNamesThatItWouldRefuse) {
    for (const char* name : {"../x", "/x", "a\\b", "./a", ""}) {
        const std::array<ZipFile, 1> files = {{{name, "x"}}};
        EXPECT_EQ(write_zip(files).error().code, "zip_bad_name") << name;
    }
    const std::array<ZipFile, 2> twice = {{{"a", "x"}, {"a", "y"}}};
    EXPECT_EQ(write_zip(twice).error().code, "zip_duplicate_name");
}

}  // namespace
}  // namespace gonio
