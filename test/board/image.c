/* Loads an ELF image: flash, symbols, and where the stack may not go. */
#include "board_internal.h"

#include <fcntl.h>
#include <gelf.h>
#include <libelf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* avr-gcc's address spaces inside an ELF file. */
#define ELF_RAM 0x800000u
#define ELF_EEPROM 0x810000u
#define ELF_EEPROM_END 0x820000u

/* Where a section is loaded: sections carry run addresses, so .data's place in flash comes from its segment. Only
 * sections with contents are looked at: a NOBITS section in front of .data (the segment ring) makes some linkers put
 * both into one segment, whose load address is then not .data's. */
static bool load_address(Elf *elf, const GElf_Shdr *section, uint32_t *address)
{
    size_t segments = 0;
    if (elf_getphdrnum(elf, &segments) != 0)
        return false;
    for (size_t i = 0; i < segments; i++) {
        GElf_Phdr segment;
        if (gelf_getphdr(elf, (int)i, &segment) == NULL || segment.p_type != PT_LOAD)
            continue;
        if (section->sh_offset >= segment.p_offset &&
            section->sh_offset + section->sh_size <= segment.p_offset + segment.p_filesz) {
            *address = (uint32_t)(segment.p_paddr + (section->sh_offset - segment.p_offset));
            return true;
        }
    }
    return false;
}

static bool copy_to(uint8_t *memory, size_t size, uint32_t address, const Elf_Data *data)
{
    if (data == NULL || address + data->d_size > size)
        return false;
    memcpy(memory + address, data->d_buf, data->d_size);
    return true;
}

static bool load_section(board_t *b, Elf *elf, Elf_Scn *scn, const GElf_Shdr *section)
{
    uint32_t address;
    if (section->sh_addr > ELF_RAM && section->sh_addr < ELF_EEPROM) {
        uint32_t end = (uint32_t)(section->sh_addr + section->sh_size - ELF_RAM);
        if (end > b->stack_limit && end <= BOARD_RAMEND + 1)
            b->stack_limit = (uint16_t)end;
    }
    if (section->sh_type != SHT_PROGBITS || section->sh_size == 0)
        return true;
    if (!load_address(elf, section, &address))
        return false;
    if (address >= ELF_EEPROM && address < ELF_EEPROM_END) {
        if (b->image_eeprom == NULL) {
            b->image_eeprom = malloc(BOARD_EEPROM_BYTES);
            if (b->image_eeprom == NULL)
                return false;
            memset(b->image_eeprom, 0xFF, BOARD_EEPROM_BYTES);
        }
        return copy_to(b->image_eeprom, BOARD_EEPROM_BYTES, address - ELF_EEPROM, elf_getdata(scn, NULL));
    }
    if (address >= ELF_RAM)
        return true; /* fuses, lock bits, signature */
    if (!copy_to(b->avr->flash, BOARD_FLASH_BYTES, address, elf_getdata(scn, NULL)))
        return false;
    if (address + section->sh_size > b->code_end)
        b->code_end = (uint32_t)(address + section->sh_size);
    return true;
}

static bool load_symbols(board_t *b, Elf *elf, Elf_Scn *scn, const GElf_Shdr *section)
{
    Elf_Data *data = elf_getdata(scn, NULL);
    size_t count = section->sh_entsize ? section->sh_size / section->sh_entsize : 0;
    b->symbols = calloc(count ? count : 1, sizeof *b->symbols);
    if (data == NULL || b->symbols == NULL)
        return false;
    for (size_t i = 0; i < count; i++) {
        GElf_Sym symbol;
        const char *name;
        if (gelf_getsym(data, (int)i, &symbol) == NULL)
            continue;
        name = elf_strptr(elf, section->sh_link, symbol.st_name);
        if (name == NULL || name[0] == '\0' || GELF_ST_TYPE(symbol.st_info) == STT_FILE)
            continue;
        b->symbols[b->symbol_count].address = (uint16_t)symbol.st_value;
        b->symbols[b->symbol_count].name = strdup(name);
        b->symbols[b->symbol_count].data = symbol.st_value >= ELF_RAM && symbol.st_value < ELF_EEPROM;
        b->symbols[b->symbol_count].global = GELF_ST_BIND(symbol.st_info) != STB_LOCAL;
        b->symbol_count++;
    }
    return true;
}

static bool load_sections(board_t *b, Elf *elf)
{
    Elf_Scn *scn = NULL;
    b->stack_limit = BOARD_RAM_START;
    while ((scn = elf_nextscn(elf, scn)) != NULL) {
        GElf_Shdr section;
        if (gelf_getshdr(scn, &section) == NULL)
            return false;
        if ((section.sh_flags & SHF_ALLOC) && !load_section(b, elf, scn, &section))
            return false;
        if (section.sh_type == SHT_SYMTAB && !load_symbols(b, elf, scn, &section))
            return false;
    }
    return b->code_end > 0;
}

bool image_load(board_t *b, const char *elf_path)
{
    bool ok = false;
    int fd = open(elf_path, O_RDONLY);
    Elf *elf;

    if (fd < 0) {
        perror(elf_path);
        return false;
    }
    elf_version(EV_CURRENT);
    elf = elf_begin(fd, ELF_C_READ, NULL);
    if (elf != NULL && elf_kind(elf) == ELF_K_ELF)
        ok = load_sections(b, elf);
    if (!ok)
        fprintf(stderr, "%s: not an image for the ATmega328P\n", elf_path);
    if (elf != NULL)
        elf_end(elf);
    close(fd);
    return ok;
}

void image_free(board_t *b)
{
    for (size_t i = 0; i < b->symbol_count; i++)
        free(b->symbols[i].name);
    free(b->symbols);
    free(b->image_eeprom);
}

bool board_symbol(const board_t *b, const char *name, uint16_t *address)
{
    const board_symbol_t *found = NULL;
    for (size_t i = 0; i < b->symbol_count; i++)
        if (strcmp(b->symbols[i].name, name) == 0 && (found == NULL || b->symbols[i].global))
            found = &b->symbols[i];
    if (found == NULL) {
        fprintf(stderr, "no symbol %s in the image\n", name);
        return false;
    }
    *address = found->address;
    return true;
}

const char *board_symbol_at(const board_t *b, uint16_t address, uint16_t *offset)
{
    const char *name = "";
    *offset = UINT16_MAX;
    for (size_t i = 0; i < b->symbol_count; i++) {
        const board_symbol_t *s = &b->symbols[i];
        if (s->data && s->address <= address && address - s->address < *offset) {
            name = s->name;
            *offset = (uint16_t)(address - s->address);
        }
    }
    return name;
}
