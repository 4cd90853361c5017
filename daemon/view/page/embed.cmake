# Writes the file INPUT, compressed by gzip, into the C++ source OUTPUT as splid_page_NAME and
# splid_page_NAME_size:
#
#   cmake -DINPUT=... -DOUTPUT=... -DNAME=... -P embed.cmake
#
# gzip -n leaves out name and time, so that the same page gives the same program.
execute_process(COMMAND gzip -9nc ${INPUT} OUTPUT_FILE ${OUTPUT}.gz COMMAND_ERROR_IS_FATAL ANY)
file(READ ${OUTPUT}.gz bytes HEX)
file(REMOVE ${OUTPUT}.gz)
string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
file(WRITE ${OUTPUT} "#include <cstddef>
extern const unsigned char splid_page_${NAME}[];
extern const std::size_t splid_page_${NAME}_size;
const unsigned char splid_page_${NAME}[] = {
${bytes}};
const std::size_t splid_page_${NAME}_size = sizeof splid_page_${NAME};
")
