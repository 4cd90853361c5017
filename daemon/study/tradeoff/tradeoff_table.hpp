#pragma once

#include <string>
#include <vector>

#include "daemon/study/tradeoff/tradeoff_report.hpp"

namespace splid::tradeoff {

// A measured tradeoff as a file, and back: comma-separated values below a line of their names.
// Threads: any.

// All rows with the members of row_json() as columns, and whether a row is the recommended
// one. A value that is not known is empty. No text at all for a report without rows.
std::string to_csv(const Report& report);

// The rows of such a table. report: says what the rows should have been measured against, and the
// configured options, which hold for all that a row does not name. file: what errors name.
// Errors: Error(Fault::data) with the line, where the text is no such table or its errors were
// measured against something else.
std::vector<Row> rows_of_csv(const std::string& text, const std::string& file,
                             const Report& report);

}  // namespace splid::tradeoff
