"""What settings are made of: blocks, which are frozen objects, and types of single values."""

from collections.abc import Mapping
from importlib import import_module
from inspect import Parameter, Signature, cleandoc
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    InstanceOf,
    TypeAdapter,
    ValidationError,
    WrapValidator,
    model_validator,
)
from pydantic_core import PydanticCustomError

from palpate.errors import InputError

T = TypeVar("T")
NAME = "^[a-z][a-z0-9_]*$"
"""The pattern of names that files and folders get."""


class _Signature:
    """The names of a class's fields and their defaults, found whenever it is read: a default may be a later class."""

    def __get__(self, _: object, kind: "type[Block]") -> Signature:
        made = {
            name: Parameter.empty
            if field.is_required()
            else field.get_default(call_default_factory=True, validated_data={})
            for name, field in kind.model_fields.items()
        }
        return Signature([Parameter(name, Parameter.KEYWORD_ONLY, default=default) for name, default in made.items()])


class Block(BaseModel):
    """A block of settings: a frozen object with no other keys than its fields.

    What ``json_schema_extra`` says of the block as a whole is checked: minProperties, maxProperties, anyOf required.
    Called with wrong fields it raises InputError; validated as a part of other settings, pydantic's ValidationError.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True)
    own_doc: ClassVar[str | None] = None
    """What the source says of the class; its ``__doc__`` has a line for each field, too."""

    @classmethod
    def __pydantic_init_subclass__(cls, **more: Any) -> None:
        super().__pydantic_init_subclass__(**more)
        cls.own_doc = cls.__doc__
        fields = [f"{name} : {field.description}" for name, field in cls.model_fields.items()]
        cls.__doc__ = "\n".join([f"{cleandoc(cls.own_doc or '')}\n", *fields]).strip()
        cls.__signature__ = _Signature()  # type: ignore[assignment]

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: GetJsonSchemaHandler) -> dict:
        reference = handler(schema)
        described = handler.resolve_ref_schema(reference)
        described.pop("description", None)
        if cls.own_doc:
            described["description"] = cleandoc(cls.own_doc)
        return reference

    def __init__(self, /, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            from palpate.explain import explain

            name = _public_name(type(self))
            message = explain(error.errors(), plain(fields), type(self).model_json_schema(), name)
            raise InputError(message if message.startswith(f"{name} ") else f"{name}: {message}") from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # validation of a whole does not call it

    def __setattr__(self, name: str, value: Any) -> None:
        raise InputError(f"{_public_name(type(self))} cannot be changed; make another one with but({name}=...).")

    def __delattr__(self, name: str) -> None:
        setattr(self, name, None)

    @model_validator(mode="after")
    def _check_entries(self) -> Self:
        given = [name for name, value in self if value is not None]
        rules: Any = self.model_config.get("json_schema_extra") or {}
        if len(given) < rules.get("minProperties", 0):
            raise PydanticCustomError("entries", "must have at least one entry")
        if len(given) > rules.get("maxProperties", len(given)):
            raise PydanticCustomError("entries", "must have only {most} entry", {"most": rules["maxProperties"]})
        if (needed := [either["required"][0] for either in rules.get("anyOf", [])]) and not set(needed) & set(given):
            raise PydanticCustomError("lacks", "lacks {name}", {"name": needed[0]})
        return self

    def but(self, **changed: Any) -> Self:
        """Return a copy with some fields changed, checked like any other."""
        return type(self)(**({name: getattr(self, name) for name in self.model_fields_set} | changed))

    def given(self) -> dict[str, Any]:
        """Return the fields by name, but optional ones that are left out."""
        fields = type(self).model_fields
        return {name: value for name, value in self if value is not None or fields[name].validate_default is not False}


def _public_name(kind: type) -> str:
    """Return what ``palpate`` calls a class, or its own name."""
    places = import_module("palpate")._PLACES
    return next((name for name, at in places.items() if at == (kind.__module__, kind.__name__)), kind.__name__)


def check(**given: tuple[Any, Any]) -> None:
    """Raise InputError for the first of the arguments, by name its type and its value, that is not of its type."""
    for name, (kind, value) in given.items():
        try:
            TypeAdapter(kind).validate_python(value)
        except ValidationError as error:
            said = error.errors()[0]["msg"]
            raise InputError(f"{name} is {value!r}: {said[:1].lower()}{said[1:]}.") from None


def plain(value: Any) -> Any:
    """Return settings as the dicts, lists and single values that a file of them has, with all defaults."""
    value = value.given() if isinstance(value, Block) else value
    if isinstance(value, Mapping):
        return {name: plain(inner) for name, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, list | tuple) else value


def key(description: str, default: Any = ..., **limits: Any) -> Any:
    """Describe a setting, which must be given if it has no default."""
    return Field(default, description=description, **limits)


def optional(*description: str, **limits: Any) -> Any:
    """Describe a setting that may be left out, and is then None; its type may say what it means, too."""
    limits |= dict(zip(("description",), description, strict=False))
    return Field(default_factory=lambda: None, validate_default=False, **limits)


def rows(names: str, *values: tuple) -> list[dict]:
    """Return a list of blocks for a default: ``names`` of the keys, and the values of each block."""
    return [dict(zip(names.split(), row, strict=True)) for row in values]


def _as_given(value: Any, validate: Any) -> Any:
    """Keep an integer where a number may stand, and 8.0 where a whole number may; numpy's become Python's."""
    value = value.tolist() if hasattr(value, "tolist") else value
    validate(int(value) if isinstance(value, float) and value.is_integer() else value)
    return value


def _distinct(values: list) -> list:
    if any(value in values[:i] for i, value in enumerate(values)):
        raise PydanticCustomError("distinct", "must not name one thing twice")
    return values


_NUMBER, _FINITE, KEPT = Field(strict=True), Field(strict=True, allow_inf_nan=False), WrapValidator(_as_given)
"""KEPT: what was given stays as it was given; a block of which it says so gets no defaults."""
Number = Annotated[float, _FINITE, KEPT]
Positive = Annotated[float, _FINITE, Field(gt=0), KEPT]
NotNegative = Annotated[float, _FINITE, Field(ge=0), KEPT]
Share = Annotated[float, _NUMBER, Field(gt=0, le=1), KEPT]
Inside = Annotated[float, _NUMBER, Field(gt=0, lt=1), KEPT]
"""Between 0 and 1, and neither of them."""
Poisson = Annotated[float, _NUMBER, Field(gt=-1, lt=0.5), KEPT]
Whole = Annotated[int, _NUMBER, KEPT]
Index = Annotated[int, _NUMBER, Field(ge=0), KEPT]
Count = Annotated[int, _NUMBER, Field(ge=1), KEPT]
Switch = Annotated[bool, _NUMBER]
Text = Annotated[str, Field(min_length=1)]
Where = Annotated[str, Field(strict=True)] | InstanceOf[Path]
Name = Annotated[str, Field(pattern=NAME)]
Axis = Literal["x", "y", "z"]
Distinct = Annotated[list[T], AfterValidator(_distinct), Field(json_schema_extra={"uniqueItems": True})]
Some = Annotated[
    list[T], Field(min_length=1), AfterValidator(_distinct), Field(json_schema_extra={"uniqueItems": True})
]
"""At least one, and none of them twice."""
Pair = Annotated[list[T], Field(min_length=2, max_length=2)]
Three = Annotated[list[T], Field(min_length=3, max_length=3)]
Vector = Three[Number]
